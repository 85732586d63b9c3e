// How long torques sent as feed-forward hold: until the robot's next command, its stop, its deadline, a
// reset.
#include <gtest/gtest.h>

#include <cmath>

#include "server/simulation/step/reference_motion.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/constants.h"
#include "tests/support/geared_drives.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

constexpr double kTorque_N_m = 40.0;
constexpr double kStep_s = 0.001;

JointArray at_rest() {
  return {
      0.0, -test::kQuarterTurn_rad, test::kQuarterTurn_rad, -test::kQuarterTurn_rad, -test::kQuarterTurn_rad,
      0.0};
}
JointCommand still() {
  JointCommand command;
  command.robot = 0;
  command.position = at_rest();
  return command;
}
/// On the vertical axis, which carries no weight.
JointCommand pushed() {
  JointCommand command = still();
  command.has_effort = true;
  command.effort[0] = kTorque_N_m;
  return command;
}
/// Stands still for a second; torques of the vertical axis at its points, or no torques.
TrajectoryCommand standing(std::vector<double> torques_N_m, double stamp_s = -1.0) {
  auto path = std::make_shared<JointPath>();
  path->has_feed_forward = !torques_N_m.empty();
  for (const double t : {0.5, 1.0}) {
    JointPathPoint& point = path->points.emplace_back();
    point.t = t;
    point.q = at_rest();
    if (path->has_feed_forward) point.feed_forward[0] = torques_N_m[t < 0.75 ? 0 : 1];
  }
  return {0, SimTime::from_seconds(stamp_s), path};
}

class HeldFeedForward : public ::testing::Test {
 protected:
  HeldFeedForward() {
    test::add_rotors(*model_);
    model_->description.robots[0].command_deadline = {0.05, SafeAction::hold, {}};
    simulation_ = std::make_unique<Simulation>(model_);
    EXPECT_EQ(simulation_->set_level_of_detail(-1, 2), "");
  }
  void step(const std::vector<Command>& commands = {}) {
    ASSERT_TRUE(simulation_->step(commands)) << simulation_->fault();
  }
  /// Until the controller has compensated the feed-forward.
  void settle() {
    for (int i = 0; i < 1500; ++i) step();
    EXPECT_NEAR(torque_N_m(), 0.0, 1e-6);
    EXPECT_NEAR(simulation_->make_snapshot().robots[0].position[0], 0.0, 1e-9);
  }
  double torque_N_m() const { return simulation_->make_snapshot().robots[0].effort[0]; }
  /// The compensation of the controller remains at once; the speed controller removes some of it within the
  /// step, and the rotor takes its share.
  void expect_gone(double held_N_m = kTorque_N_m) {
    EXPECT_LT(torque_N_m(), -0.3 * held_N_m);
    EXPECT_GT(torque_N_m(), -held_N_m);
  }

  std::shared_ptr<CellModel> model_ = test::service_model();
  std::unique_ptr<Simulation> simulation_;
};

TEST_F(HeldFeedForward, FeedForwardHoldsUntilTheNextCommand) {
  step({pushed()});
  EXPECT_GT(torque_N_m(), 0.3 * kTorque_N_m);
  settle();
  step({pushed()});
  EXPECT_NEAR(torque_N_m(), 0.0, 1e-6) << "the same again";
  JointCommand half = pushed();
  half.effort[0] *= 0.5;
  step({half});
  expect_gone(0.5 * kTorque_N_m);
  settle();
  step({still()});
  expect_gone(0.5 * kTorque_N_m);
}

TEST_F(HeldFeedForward, FeedForwardEndsWithATrajectoryAndWithAStop) {
  step({pushed()});
  settle();
  step({standing({}, 2.0)});  // continues until the other begins
  EXPECT_NEAR(torque_N_m(), 0.0, 1e-6);
  while (simulation_->step_index() < 2000) step();
  EXPECT_NEAR(torque_N_m(), 0.0, 1e-6);
  step();
  expect_gone();
  simulation_->reset();
  EXPECT_EQ(simulation_->set_level_of_detail(-1, 2), "");
  step({pushed()});
  settle();
  step({TrajectoryCommand{0, {}, std::make_shared<JointPath>()}});
  expect_gone();
}

TEST_F(HeldFeedForward, FeedForwardEndsAtADeadline) {
  for (const SafeAction action : {SafeAction::hold, SafeAction::stop}) {
    model_->description.robots[0].command_deadline.action = action;
    model_->description.robots[0].command_deadline.deadline_s = 2.0;
    Simulation watched(model_);
    ASSERT_EQ(watched.set_level_of_detail(-1, 2), "");
    watched.watch_deadlines(true);
    const std::vector<Command> commands{pushed()};
    ASSERT_TRUE(watched.step(commands));
    while (watched.step_index() < 2000) ASSERT_TRUE(watched.step({}));
    EXPECT_NEAR(watched.make_snapshot().robots[0].effort[0], 0.0, 1e-6);
    ASSERT_TRUE(watched.step({}));
    EXPECT_LT(watched.make_snapshot().robots[0].effort[0], -0.3 * kTorque_N_m);
  }
}

TEST_F(HeldFeedForward, FeedForwardEndsWithAResetAndMovesNoKinematicRobot) {
  Simulation other(model_);
  ASSERT_EQ(other.set_level_of_detail(-1, 2), "");
  step({pushed()});
  for (int i = 0; i < 20; ++i) step();
  simulation_->reset();
  ASSERT_EQ(simulation_->set_level_of_detail(-1, 2), "");
  for (int i = 0; i < 20; ++i) {
    step();
    ASSERT_TRUE(other.step({}));
  }
  EXPECT_EQ(simulation_->state_hash(), other.state_hash());

  Simulation with(model_), without(model_);
  for (int i = 0; i < 20; ++i) {
    const std::vector<Command> some{pushed()}, none{still()};
    ASSERT_TRUE(with.step(some));
    ASSERT_TRUE(without.step(none));
  }
  EXPECT_EQ(with.state_hash(), without.state_hash());
}

TEST_F(HeldFeedForward, NonFiniteFeedForwardIsAFaultAndNothingMoves) {
  JointCommand wrong = pushed();
  wrong.effort[3] = std::nan("");
  const std::vector<Command> commands{wrong};
  EXPECT_FALSE(simulation_->step(commands));
  EXPECT_NE(simulation_->fault().find("is not a finite number"), std::string::npos);
}

// A level that begins while torques are held: the drives' integrators then have the remainder.
TEST_F(HeldFeedForward, InitialStatesOfDrivesIncludeFeedForward) {
  ASSERT_EQ(simulation_->set_level_of_detail(-1, 1), "");
  step({pushed()});
  for (int i = 0; i < 100; ++i) step();
  ASSERT_EQ(simulation_->set_level_of_detail(-1, 2), "");
  for (int i = 0; i < 20; ++i) {
    step();
    EXPECT_NEAR(torque_N_m(), 0.0, 1e-6);
  }
  step({still()});
  expect_gone();
}

// At the end of each step; from the torques held at the trajectory's start, and the last one stays.
TEST_F(HeldFeedForward, FeedForwardOfATrajectoryIsLinearBetweenPoints) {
  std::vector<KinematicRobot> robots;
  for (const KinematicRobotParameters& parameters : model_->robots) robots.emplace_back(parameters);
  std::vector<MotionNotice> notices;
  ReferenceMotion reference(model_->description, 0, robots[0], notices);
  robots[0].set_feed_forward(pushed().effort.data());
  std::uint64_t step_index = 0;
  const auto advance = [&] {
    reference.advance(static_cast<double>(step_index) * kStep_s, step_index, false);
    ++step_index;
    return robots[0].feed_forward()[0];
  };
  reference.apply(standing({20.0, -10.0}), 0.0, 0);
  while (step_index < 1200) {
    const double found_N_m = advance();
    const double t = static_cast<double>(step_index) * kStep_s;
    const double wanted_N_m = t < 0.5   ? kTorque_N_m + t / 0.5 * (20.0 - kTorque_N_m)
                              : t < 1.0 ? 20.0 - (t - 0.5) / 0.5 * 30.0
                                        : -10.0;
    ASSERT_NEAR(found_N_m, wanted_N_m, 1e-9) << t;
  }
  EXPECT_EQ(robots[0].feed_forward()[1], 0.0);
  // Begun in the past: its second half.
  reference.apply(standing({0.0, 10.0}, 0.45), 1.2, step_index);
  EXPECT_NEAR(advance(), (1.201 - 0.95) / 0.5 * 10.0, 1e-9);
  reference.apply(standing({}), 1.201, step_index);
  EXPECT_EQ(advance(), 0.0);
}

}  // namespace
}  // namespace takt
