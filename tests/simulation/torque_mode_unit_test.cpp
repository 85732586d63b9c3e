// What begins and ends the torque mode of a robot, refusals, and saved states in the middle of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "server/runtime/requests/event.h"
#include "server/simulation/model/solver.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/geared_drives.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"
#include "tests/support/state_runs.h"

namespace takt::test {
namespace {

using Kind = MotionNotice::Kind;
constexpr double kTorqueStep_s = 0.001;

Command torque(double first_axis_N_m) {
  JointCommand command;
  command.robot = 0;
  command.has_effort = command.torque_mode = true;
  command.effort[0] = first_axis_N_m;
  return command;
}

class TorqueMode : public testing::Test {
 protected:
  TorqueMode() { add_rotors(*model_); }
  void make(int level = 2) {
    simulation_ = std::make_unique<Simulation>(model_);
    EXPECT_EQ(simulation_->set_level_of_detail(-1, level), "");
    simulation_->watch_deadlines(true);
    robot_ = simulation_->make_snapshot().robots[0];
  }
  void step(const std::vector<Command>& commands = {}) {
    ASSERT_TRUE(simulation_->step(commands)) << simulation_->fault();
    robot_ = simulation_->make_snapshot().robots[0];
    for (const MotionNotice& notice : simulation_->events().motion_notices) notices_.push_back(notice);
  }
  void steps(int count, const std::vector<Command>& commands = {}) {
    for (int i = 0; i < count; ++i) step(commands);
  }
  int count(Kind kind) const {
    return static_cast<int>(std::count_if(notices_.begin(), notices_.end(),
                                          [kind](const MotionNotice& one) { return one.kind == kind; }));
  }
  double q() const { return robot_.position[0]; }
  double qd() const { return robot_.velocity[0]; }
  /// Of the newest event of this step.
  std::string event() const {
    std::string text;
    report_step(*simulation_,
                [&](const EventRecord& record) { text = describe(record, model_->description).message; });
    return text;
  }

  std::shared_ptr<CellModel> model_ = service_model();
  std::unique_ptr<Simulation> simulation_;
  RobotSample robot_;
  std::vector<MotionNotice> notices_;
};

TEST_F(TorqueMode, AKinematicRobotRefusesTorquesOnceInARow) {
  make(1);
  const RobotSample before = robot_;
  step({torque(50.0)});
  EXPECT_THAT(event(), testing::HasSubstr("Robot1 takes no torques: at level of detail 1"));
  steps(20, {torque(50.0)});
  EXPECT_EQ(count(Kind::torques_refused), 1);
  EXPECT_EQ(robot_.position, before.position);
  EXPECT_EQ(robot_.commands_applied, before.commands_applied);
  step({swing(0, 0.0)});
  step({torque(50.0)});
  EXPECT_EQ(count(Kind::torques_refused), 2);
}

TEST_F(TorqueMode, ATrajectoryBeginsWhereTorquesHaveTakenTheRobot) {
  make();
  steps(200, {torque(30.0)});
  EXPECT_GT(qd(), 0.05);
  const double begin = q(), speed = qd();
  auto path = std::make_shared<JointPath>();
  JointPathPoint& point = path->points.emplace_back();
  path->order = PathOrder::cubic;
  point.t = 1.0;
  std::copy_n(robot_.position.begin(), 6, point.q.begin());
  point.q[0] += 0.3;
  step({TrajectoryCommand{0, {}, path}});
  EXPECT_NEAR(q(), begin + kTorqueStep_s * speed, 0.1 * kTorqueStep_s * speed);
  EXPECT_NEAR(qd(), speed, 0.1 * speed);
  steps(2000);
  EXPECT_EQ(count(Kind::trajectory_refused), 0);
  EXPECT_NEAR(q(), begin + 0.3, 1e-4);
}

// Whatever the safe action is: a robot without torques would fall by its load.
TEST_F(TorqueMode, AMissedDeadlineEndsItAndTheRobotHolds) {
  for (const SafeAction action : {SafeAction::hold, SafeAction::stop}) {
    takt::CommandDeadline& deadline = model_->description.robots[0].command_deadline;
    deadline.deadline_s = 0.05;
    deadline.action = action;
    make();
    notices_.clear();
    steps(200, {torque(30.0)});
    const double speed = qd();
    EXPECT_GT(speed, 0.05);
    steps(49);
    EXPECT_EQ(count(Kind::deadline_missed), 0);
    EXPECT_GT(qd(), speed);
    steps(2);
    EXPECT_EQ(count(Kind::deadline_missed), 1);
    steps(2000);
    const double held = q();
    EXPECT_NEAR(qd(), 0.0, 1e-6);
    steps(500);
    EXPECT_NEAR(q(), held, 1e-6);
    step({torque(30.0)});
    steps(30);
    EXPECT_GT(qd(), 1e-3) << "the next torque moves it again";
  }
}

TEST_F(TorqueMode, TorquesThatWouldLeaveTheLimitsEndAheadOfThem) {
  JointModel& joint = model_->robots[0].arm.joints[0];
  joint.lower = -0.5, joint.upper = 0.5;
  model_->description.robots[0].arm.joints[0] = joint;
  make();
  double largest = 0.0;
  for (int i = 0; i < 3000 && count(Kind::torques_ended) == 0; ++i) {
    step({torque(20.0)});
    largest = std::max(largest, q());
  }
  ASSERT_EQ(count(Kind::torques_ended), 1);
  EXPECT_THAT(event(),
              testing::HasSubstr("the torques would take the position of joint 'shoulder_pan_joint'"));
  EXPECT_THAT(event(), testing::HasSubstr("out of [-0.5, 0.5] rad"));
  EXPECT_EQ(notices_.back().joint, 0);
  EXPECT_FALSE(notices_.back().velocity);
  EXPECT_GT(q(), 0.3);
  // Torques have no effect while it brakes.
  const double speed = qd();
  steps(20, {torque(20.0)});
  EXPECT_LT(qd(), speed);
  EXPECT_EQ(count(Kind::torques_ended), 1);
  steps(2000);
  largest = std::max(largest, q());
  EXPECT_LT(largest, 0.52);
  EXPECT_NEAR(qd(), 0.0, 1e-5);
  steps(100, {torque(-20.0)});
  EXPECT_LT(qd(), -1e-3);

  joint.lower = -6.0, joint.upper = 6.0, joint.max_velocity = 0.4;
  model_->description.robots[0].arm.joints[0] = joint;
  make();
  notices_.clear();
  for (int i = 0; i < 3000 && count(Kind::torques_ended) == 0; ++i) {
    step({torque(20.0)});
    EXPECT_LT(qd(), 0.45);
  }
  ASSERT_EQ(count(Kind::torques_ended), 1);
  EXPECT_TRUE(notices_.back().velocity);
  EXPECT_GT(notices_.back().value, 0.4);
}

TEST_F(TorqueMode, AChangeOfLevelAndAResetEndIt) {
  make();
  steps(100, {torque(30.0)});
  EXPECT_EQ(simulation_->set_level_of_detail(-1, 1), "");
  const double begin = q();
  steps(300);
  EXPECT_EQ(qd(), 0.0);
  EXPECT_NEAR(q(), begin, 0.05);
  EXPECT_EQ(simulation_->set_level_of_detail(-1, 2), "");
  const double held = q();
  steps(300);
  EXPECT_NEAR(q(), held, 1e-6);

  steps(100, {torque(30.0)});
  simulation_->reset();
  EXPECT_EQ(simulation_->set_level_of_detail(-1, 2), "");
  steps(100);
  EXPECT_NEAR(q(), 0.0, 1e-9);
}

TEST_F(TorqueMode, ANonFiniteTorqueIsAFault) {
  make();
  const std::vector<Command> commands{torque(std::nan(""))};
  EXPECT_FALSE(simulation_->step(commands));
  EXPECT_THAT(simulation_->fault(), testing::HasSubstr("is not a finite number"));
}

/// Set-points, torques and silence in turn.
StepCommands mixed_commands(std::size_t steps) {
  std::mt19937 dice(5);
  StepCommands commands(steps);
  for (std::size_t i = 0; i < steps; i += 4) {
    const int robot = static_cast<int>(dice() % 2);
    if (dice() % 5 == 0) continue;
    if (dice() % 4 == 0) {
      JointCommand command = swing(robot, 1e-3 * static_cast<double>(dice() % 20));
      command.stamp = {};
      commands[i].emplace_back(command);
      continue;
    }
    JointCommand command;
    command.robot = robot;
    command.has_effort = command.torque_mode = true;
    for (std::size_t j = 0; j < 6; ++j) command.effort[j] = static_cast<double>(dice() % 21) - 10.0;
    commands[i].emplace_back(command);
  }
  return commands;
}

class SavedTorqueMode : public testing::TestWithParam<std::string> {};
TEST_P(SavedTorqueMode, ASavedStateGoesOnWithTheSameBits) {
  auto model = service_model();
  add_rotors(*model);
  model->solver.name = GetParam();
  model->solver.tolerance = solver_default_tolerance(GetParam());
  check_restored_runs(model, mixed_commands(160), {3, 42, 90}, 60,
                      [](Simulation& run) { ASSERT_EQ(run.set_level_of_detail(-1, 2), ""); });
}
INSTANTIATE_TEST_SUITE_P(Solvers, SavedTorqueMode,
                         testing::ValuesIn(std::vector<std::string>(solver_names().begin(),
                                                                    solver_names().end())),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace takt::test
