// Goals in the step loop: tolerances, pre-emption, cancellation, lockstep, and their independence of the pace.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "server/runtime/loop/run_loop.h"
#include "tests/support/constants.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

struct Order {
  Command command;
  std::shared_ptr<MotionGoal> goal;
};

Order turn(const CellDescription& cell, std::uint64_t number, double first, double time_s,
           double stamp_s = -1.0) {
  RawTrajectory raw{SimTime::from_seconds(stamp_s), {}, {}};
  for (const JointModel& joint : cell.robots[0].arm.joints) raw.names.push_back(joint.name);
  raw.points.push_back({{first, -test::kQuarterTurn_rad, test::kQuarterTurn_rad, -test::kQuarterTurn_rad,
                         -test::kQuarterTurn_rad, 0.0},
                        std::vector<double>(6, 0.0),
                        {},
                        {},
                        time_s});
  const auto command = std::get<TrajectoryCommand>(validate(cell, 0, raw));
  auto goal = std::make_shared<MotionGoal>();
  goal->kind = MotionGoal::Kind::trajectory;
  goal->number = number;
  goal->target = 0;
  goal->path = command.path;
  goal->stamp = command.stamp;
  return {command, goal};
}

Order grip(std::uint64_t number, double width_m) {
  auto goal = std::make_shared<MotionGoal>();
  goal->kind = MotionGoal::Kind::grip;
  goal->number = number;
  goal->target = 2;
  goal->width_m = width_m;
  goal->width_tolerance_m = 0.001;
  goal->stall_timeout_s = 1.0;
  GripperCommand command;
  command.gripper = 0;
  command.action = GripperAction::width;
  command.width_m = width_m;
  return {command, goal};
}

Order cancel(std::uint64_t number, int target) {
  auto goal = std::make_shared<MotionGoal>();
  goal->kind = MotionGoal::Kind::cancel;
  goal->number = number;
  goal->target = target;
  GripperCommand of_gripper;
  of_gripper.gripper = 0;
  return {target == 0 ? Command(TrajectoryCommand{target, {}, {}}) : Command(of_gripper), goal};
}

/// A paused loop that a test steps.
class GoalMonitorTest : public testing::Test {
 protected:
  explicit GoalMonitorTest(Pace pace = Pace::free,
                           const std::shared_ptr<const CellModel>& model = test::service_model())
      : simulation_(model),
        loop_(simulation_, {.pace = pace, .state = SimulationState::paused}),
        reader_(loop_) {
    loop_.start();
  }
  ~GoalMonitorTest() override { loop_.stop(); }

  const CellDescription& cell() const { return loop_.cell(); }
  void append(const Order& order) { EXPECT_FALSE(loop_.append(order.command, order.goal)); }
  void step(int count) {
    ASSERT_EQ(reader_.request("step", {{"steps", std::to_string(count)}}).result, ControlResult::ok);
    read();
  }
  void read() {
    GoalReport report;
    while (loop_.output().goals.pop(report)) reports_.push_back(report);
  }
  /// The end of a goal, or nullptr.
  const GoalReport* end(std::uint64_t number) {
    read();
    for (const GoalReport& report : reports_)
      if (report.number == number && report.end != GoalEnd::none) return &report;
    return nullptr;
  }
  const GoalReport* wait_for_end(std::uint64_t number) {
    return reader_.wait_until([&] { return end(number) != nullptr; }) ? end(number) : nullptr;
  }

  Simulation simulation_;
  RunLoop loop_;
  test::LoopReader reader_;
  std::vector<GoalReport> reports_;
};

TEST_F(GoalMonitorTest, AGoalEndsInTheStepThatReachesItsLastPoint) {
  append(turn(cell(), 7, 0.1, 0.2));
  step(199);
  EXPECT_EQ(end(7), nullptr);
  step(1);
  ASSERT_NE(end(7), nullptr);
  EXPECT_EQ(end(7)->end, GoalEnd::reached);
  EXPECT_NEAR(end(7)->time_s, 0.2, 1e-12);
  EXPECT_NEAR(end(7)->position[0], 0.1, 1e-12);
  ASSERT_EQ(reports_.size(), 5U);
  EXPECT_TRUE(reports_[0].begins);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(reports_[i].time_s, 0.05 * static_cast<double>(i), 1e-12);
}

TEST_F(GoalMonitorTest, AStampedGoalBeginsAtItsStamp) {
  append(turn(cell(), 1, 0.1, 0.2, 0.05));
  step(249);
  EXPECT_EQ(end(1), nullptr);
  step(1);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::reached);
  EXPECT_NEAR(reports_.front().time_s, 0.05, 1e-12);
}

TEST_F(GoalMonitorTest, ANewGoalPreemptsAndACommandReplaces) {
  append(turn(cell(), 1, 0.1, 0.2));
  step(10);
  append(turn(cell(), 2, 0.2, 0.2));
  step(10);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::preempted);
  EXPECT_FALSE(loop_.append(turn(cell(), 0, 0.1, 0.2).command, 1, monotonic_now_ns()));
  step(1);
  ASSERT_NE(end(2), nullptr);
  EXPECT_EQ(end(2)->end, GoalEnd::replaced);
  // Of two that wait for the same step the later one counts.
  append(turn(cell(), 3, 0.1, 0.2));
  append(turn(cell(), 4, 0.1, 0.2));
  step(200);
  ASSERT_NE(end(3), nullptr);
  EXPECT_EQ(end(3)->end, GoalEnd::preempted);
  ASSERT_NE(end(4), nullptr);
  EXPECT_EQ(end(4)->end, GoalEnd::reached);
}

TEST_F(GoalMonitorTest, ACancelledGoalStopsTheRobotAndALateCancellationDoesNot) {
  append(turn(cell(), 1, 0.5, 0.5));
  step(250);
  append(cancel(1, 0));
  ASSERT_NE(wait_for_end(1), nullptr) << "without a step";
  EXPECT_EQ(end(1)->end, GoalEnd::cancelled);
  step(1000);
  Snapshot snapshot = simulation_.make_snapshot();
  ASSERT_TRUE(loop_.between_steps([&] { simulation_.read_snapshot(snapshot); }));
  EXPECT_EQ(snapshot.robots[0].velocity[0], 0.0);
  EXPECT_LT(snapshot.robots[0].position[0], 0.49) << "it went on to its goal";
  append(turn(cell(), 2, 0.5, 0.5));
  step(10);
  append(cancel(1, 0));  // ended long ago
  step(500);
  ASSERT_NE(end(2), nullptr);
  EXPECT_EQ(end(2)->end, GoalEnd::reached);
}

TEST_F(GoalMonitorTest, APathToleranceStopsARobotWhoseDrivesLag) {
  ASSERT_EQ(reader_.request("set_level_of_detail", {{"level_of_detail", "2"}}).result, ControlResult::ok);
  Order loose = turn(cell(), 1, 0.3, 0.5);
  loose.goal->path_tolerance.position[0] = 0.2;
  append(loose);
  step(600);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::reached);
  Order tight = turn(cell(), 2, 0.0, 0.5);
  tight.goal->path_tolerance.position[0] = 1e-7;
  append(tight);
  step(600);
  ASSERT_NE(end(2), nullptr);
  EXPECT_EQ(end(2)->end, GoalEnd::path_tolerance);
  EXPECT_EQ(end(2)->joint, 0);
  EXPECT_GT(end(2)->value, 1e-7);
  EXPECT_EQ(end(2)->limit, 1e-7);
  Snapshot snapshot = simulation_.make_snapshot();
  ASSERT_TRUE(loop_.between_steps([&] { simulation_.read_snapshot(snapshot); }));
  EXPECT_GT(snapshot.robots[0].position[0], 0.2) << "it went on to its goal";
}

TEST_F(GoalMonitorTest, AGoalToleranceWaitsForItsTime) {
  ASSERT_EQ(reader_.request("set_level_of_detail", {{"level_of_detail", "2"}}).result, ControlResult::ok);
  Order never = turn(cell(), 1, 0.3, 0.5);
  never.goal->goal_tolerance.position[1] = 1e-15;
  never.goal->goal_time_tolerance_s = 0.25;
  append(never);
  step(749);
  EXPECT_EQ(end(1), nullptr);
  step(5);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::goal_tolerance);
  EXPECT_EQ(end(1)->joint, 1);
  EXPECT_NEAR(end(1)->time_s, 0.751, 1e-9);
}

TEST_F(GoalMonitorTest, AGoalTheRobotCannotFollowIsRefusedWithItsLimit) {
  append(turn(cell(), 1, 0.5, 0.01));
  step(1);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::refused);
  EXPECT_EQ(end(1)->joint, 0);
  EXPECT_TRUE(end(1)->of_velocity);
  EXPECT_GT(end(1)->value, end(1)->limit);
}

TEST_F(GoalMonitorTest, AResetEndsGoalsThatRunAndThatWait) {
  append(turn(cell(), 1, 0.1, 0.2));
  step(10);
  append(grip(2, 0.05));
  ASSERT_EQ(reader_.request("reset").result, ControlResult::ok);
  for (const std::uint64_t number : {1, 2}) {
    ASSERT_NE(wait_for_end(number), nullptr);
    EXPECT_EQ(end(number)->end, GoalEnd::reset);
  }
}

TEST_F(GoalMonitorTest, AChangeOfPaceKeepsAGoalThatWaits) {
  append(turn(cell(), 1, 0.1, 0.2));
  ASSERT_EQ(reader_.request("set_pace", {{"pace", "realtime"}, {"factor", "1"}}).result, ControlResult::ok);
  step(200);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::reached);
}

TEST_F(GoalMonitorTest, AGripperReachesItsWidthOrStandsBeforeIt) {
  append(grip(1, 0.05));
  step(2000);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::reached);
  EXPECT_NEAR(end(1)->width_m, 0.05, 0.001);
  EXPECT_EQ(end(1)->part, -1);
  append(grip(2, 0.1));
  step(100);
  append(cancel(2, 2));
  ASSERT_NE(wait_for_end(2), nullptr);
  EXPECT_EQ(end(2)->end, GoalEnd::cancelled);
  const double there = end(2)->width_m;
  step(2000);
  Snapshot snapshot = simulation_.make_snapshot();
  ASSERT_TRUE(loop_.between_steps([&] { simulation_.read_snapshot(snapshot); }));
  EXPECT_NEAR(snapshot.grippers[0].width_m, there, 1e-3);
  EXPECT_LT(there, 0.09);
}

class GoalMonitorLockstepTest : public GoalMonitorTest {
 protected:
  GoalMonitorLockstepTest() : GoalMonitorTest(Pace::lockstep) {}
};

TEST_F(GoalMonitorLockstepTest, AGoalTakesThePlaceOfACommandAtTheBoundaryOfItsController) {
  ASSERT_EQ(
      reader_
          .request("register_controller",
                   {{"name", "plc"}, {"period", "0.008"}, {"command_timeout", "600"}, {"targets", "Robot1"}})
          .result,
      ControlResult::ok);
  ASSERT_EQ(reader_.request("set_state", {{"state", "1"}}).result, ControlResult::ok);
  append(turn(cell(), 1, 0.1, 0.2));
  ASSERT_NE(wait_for_end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::reached);
  EXPECT_NEAR(end(1)->time_s, 0.2, 1e-12) << "it took effect at the boundary that the loop waited at";
}

/// The cell of config/scenarios/weak_grip.yaml, without gravity and with open jaws.
std::shared_ptr<const CellModel> floating_block() {
  const std::filesystem::path scenarios = std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios";
  std::ifstream file(scenarios / "weak_grip.yaml");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto change = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
  };
  change("../", std::string(TAKT_CONFIG_DIR) + "/");
  change("initial_width_m: 0.070", "initial_width_m: 0.110");
  change("solver:", "world: {gravity_m_per_s2: [0, 0, 0]}\n\nsolver:");
  test::TemporaryDirectory directory;
  directory.write("floating.yaml", text);
  return load_cell(directory / "floating.yaml");
}

class GoalMonitorGripTest : public GoalMonitorTest {
 protected:
  GoalMonitorGripTest() : GoalMonitorTest(Pace::free, floating_block()) {}
};

TEST_F(GoalMonitorGripTest, JawsThatHoldAPartStallAndKeepItWhenTheirGoalIsCancelled) {
  const GripperDescription& gripper = cell().grippers[0];
  const int block = cell().find_component("Block");
  Order close = grip(1, 0.0);
  close.goal->target = 1;
  Order again = grip(2, 0.01);
  again.goal->target = 1;
  Snapshot snapshot = simulation_.make_snapshot();
  ASSERT_TRUE(loop_.between_steps([&] {
    // The block, whose origin is in its base, centred between the jaws.
    simulation_.read_snapshot(snapshot);
    const ComponentSample& palm = snapshot.components[static_cast<std::size_t>(gripper.component)];
    const Quat q_WT = palm.q_WB * gripper.X_GT.quaternion();
    Pose there;
    there.p = palm.p_WB + palm.q_WB * gripper.X_GT.p + q_WT * Vec3(0.0, 0.0, 0.045);
    there.R = (q_WT * Quat(0.0, 1.0, 0.0, 0.0)).toRotationMatrix();
    EXPECT_EQ(simulation_.set_component_state(block, there, Twist{}), "");
  }));
  append(close);
  step(1000);
  EXPECT_EQ(end(1), nullptr) << "the jaws have stood for less than a second";
  step(1000);
  ASSERT_NE(end(1), nullptr);
  EXPECT_EQ(end(1)->end, GoalEnd::stalled);
  EXPECT_EQ(end(1)->part, block);
  EXPECT_GT(end(1)->width_m, 0.05);
  append(again);
  step(100);
  append(cancel(2, 1));
  ASSERT_NE(wait_for_end(2), nullptr);
  step(500);
  ASSERT_TRUE(loop_.between_steps([&] { simulation_.read_snapshot(snapshot); }));
  EXPECT_EQ(snapshot.grippers[0].part, block);
  EXPECT_EQ(snapshot.grippers[0].commands_applied, 2U);
}

}  // namespace
}  // namespace takt
