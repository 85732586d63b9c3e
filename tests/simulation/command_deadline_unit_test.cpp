// Streams of set-points that fall silent: hold or controlled stop, measured in simulated time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/runtime/requests/event.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/constants.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

constexpr double kSpeed = 0.5, kDeadline_s = 0.05, kAcceleration = 2.0;

class CommandDeadline : public ::testing::Test {
 protected:
  void make(SafeAction action, bool watch = true) {
    model_ = test::service_model();
    takt::CommandDeadline& deadline = model_->description.robots[0].command_deadline;
    deadline.deadline_s = kDeadline_s;
    deadline.action = action;
    deadline.max_acceleration.fill(kAcceleration);
    simulation_ = std::make_unique<Simulation>(model_);
    simulation_->watch_deadlines(watch);
    snapshot_ = simulation_->make_snapshot();
  }
  void step(std::vector<Command> commands = {}) {
    ASSERT_TRUE(simulation_->step(commands)) << simulation_->fault();
    simulation_->read_snapshot(snapshot_);
    for (const MotionNotice& notice : simulation_->events().motion_notices) notices_.push_back(notice);
  }
  /// A stream at constant speed along axis 1, from `begin` on, up to and with step `last`.
  void stream_until(std::uint64_t last, double begin = 0.0, double speed = kSpeed) {
    while (simulation_->step_index() <= last) {
      if (simulation_->step_index() % 8 != 0) {
        step();
        continue;
      }
      JointCommand command;
      command.robot = 0;
      command.has_velocity = true;
      command.position = {begin + speed * (simulation_->time_s() + 0.008),
                          -test::kQuarterTurn_rad,
                          test::kQuarterTurn_rad,
                          -test::kQuarterTurn_rad,
                          -test::kQuarterTurn_rad,
                          0.0};
      command.velocity = {speed};
      step({command});
    }
  }
  double q() const { return snapshot_.robots[0].position[0]; }
  double qd() const { return snapshot_.robots[0].velocity[0]; }

  std::shared_ptr<CellModel> model_;
  std::unique_ptr<Simulation> simulation_;
  Snapshot snapshot_;
  std::vector<MotionNotice> notices_;
};

TEST_F(CommandDeadline, HoldKeepsTheLastSetPointAndIsReported) {
  make(SafeAction::hold);
  stream_until(400);  // the last set-point at 0.4 s
  while (simulation_->step_index() < 450) step();
  EXPECT_TRUE(notices_.empty());
  step();  // from 0.45 s on
  ASSERT_EQ(notices_.size(), 1U);
  EXPECT_EQ(notices_[0].kind, MotionNotice::Kind::deadline_missed);
  EXPECT_NEAR(notices_[0].time_s, 0.45, 1e-9);
  EXPECT_NEAR(notices_[0].value, 0.05, 1e-9);
  std::vector<EventRecord> records;
  report_step(*simulation_, [&](const EventRecord& record) { records.push_back(record); });
  ASSERT_EQ(records.size(), 1U);
  const EventText text = describe(records[0], model_->description);
  EXPECT_EQ(text.subject, "Robot1");
  EXPECT_THAT(text.message, ::testing::HasSubstr("Its safe action follows: hold"));
  const double there = q();
  for (int i = 0; i < 100; ++i) step();
  EXPECT_EQ(q(), there);
  EXPECT_EQ(qd(), 0.0);
  EXPECT_EQ(notices_.size(), 1U) << "reported once";
}

TEST_F(CommandDeadline, StopFollowsTheCommandUntilTheDeadlineAndBrakesWithinLimits) {
  make(SafeAction::stop);
  stream_until(400);
  while (simulation_->step_index() < 450) {
    step();
    ASSERT_NEAR(qd(), kSpeed, 1e-9) << simulation_->time_s();
  }
  const double begin = q();
  EXPECT_NEAR(begin, kSpeed * 0.45, 2e-3);
  while (qd() > 0.0) {
    const double before = qd();
    step();
    ASSERT_LE(before - qd(), kAcceleration * 0.001 * (1.0 + 1e-6));
  }
  const double duration = kSpeed / kAcceleration;
  EXPECT_NEAR(simulation_->time_s(), 0.45 + duration, 1e-3 + 1e-9);
  EXPECT_NEAR(q(), begin + 0.5 * kSpeed * duration, 1e-9);
  ASSERT_EQ(notices_.size(), 1U);
  EXPECT_NEAR(notices_[0].time_s, 0.45, 1e-9);
  const double there = q();
  for (int i = 0; i < 100; ++i) step();
  EXPECT_EQ(q(), there);
}

TEST_F(CommandDeadline, BrakingStaysWithinTheLimitsOfPosition) {
  make(SafeAction::stop);
  const double upper = model_->description.robots[0].arm.joints[0].upper;
  JointCommand near;
  near.robot = 0;
  near.position = {upper - 0.23,
                   -test::kQuarterTurn_rad,
                   test::kQuarterTurn_rad,
                   -test::kQuarterTurn_rad,
                   -test::kQuarterTurn_rad,
                   0.0};
  model_->robots[0].q_initial = near.position;
  simulation_ = std::make_unique<Simulation>(model_);
  simulation_->watch_deadlines(true);
  stream_until(400, near.position[0]);
  for (int i = 0; i < 1000; ++i) {
    step();
    ASSERT_LE(q(), upper + 1e-12);
  }
  EXPECT_EQ(qd(), 0.0);
  EXPECT_GT(q(), upper - 0.03);
  EXPECT_EQ(notices_.size(), 1U);
}

TEST_F(CommandDeadline, CommandsInTimeKeepTheMotionAndLockstepHasNoDeadline) {
  make(SafeAction::stop);
  stream_until(400);
  while (simulation_->step_index() < 500) step();  // braking
  ASSERT_EQ(notices_.size(), 1U);
  stream_until(800, q() - kSpeed * (simulation_->time_s() + 0.004));
  EXPECT_EQ(notices_.size(), 1U);
  EXPECT_NEAR(qd(), kSpeed, 1e-9);
  notices_.clear();
  make(SafeAction::stop, false);
  stream_until(400);
  while (simulation_->step_index() < 600) step();
  EXPECT_TRUE(notices_.empty());
  EXPECT_EQ(qd(), 0.0) << "faded, as ever";
}

TEST_F(CommandDeadline, AStateSavedWhileBrakingContinuesWithTheSameBits) {
  make(SafeAction::stop);
  stream_until(400);
  while (simulation_->step_index() < 480) step();
  std::vector<std::byte> saved;
  simulation_->save_state(saved);
  while (simulation_->step_index() < 1000) step();
  Simulation other(model_);
  other.watch_deadlines(true);
  ASSERT_EQ(other.restore_state(saved), "");
  while (other.step_index() < 1000) ASSERT_TRUE(other.step({}));
  EXPECT_EQ(other.state_hash(), simulation_->state_hash());
}

}  // namespace
}  // namespace takt
