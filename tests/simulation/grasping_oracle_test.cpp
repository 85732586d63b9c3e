// Grips at level of detail 1, and the load of their friction, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"
#include "tests/support/constants.h"

namespace takt::test {
namespace {

const Command kClose = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
const Command kOpen = GripperCommand{0, {}, GripperAction::open, 0.0, 0.0};

/// A gantry above a table whose flange is at z = 0.5 and reaches down to 0.44 with its jaws.
class GraspingTest : public testing::TestWithParam<GraspRule> {
 protected:
  void SetUp() override {
    palm_ = cell_.gantry_with_gripper("R", "G", at(0, 0, 0.5), GetParam());
    table_ = cell_.ground("T", {1, 1, 0.1}, at(0, 0, 0.3));
  }
  void start() { simulation_.emplace(cell_.build()); }
  void run(double seconds, std::vector<Command> first = {}) {
    const auto steps = static_cast<int>(std::lround(seconds / 0.001));
    for (int i = 0; i < steps; ++i) {
      ASSERT_TRUE(simulation_->step(i == 0 ? std::span<const Command>(first) : std::span<const Command>{}));
      for (const WeakGrip& grip : simulation_->events().weak_grips) weak_.push_back(grip);
    }
  }
  /// Straight up by this distance, from rest to rest with this largest acceleration (cosine).
  void lift(double by_m, double acceleration) {
    const double T = std::sqrt(2.0 * M_PI * std::abs(by_m) / acceleration);
    const double from = height_;
    for (double t = 0.0; t < T + 0.0079; t += 0.008) {
      const double s = std::min(1.0, (t + 0.008) / T);
      JointArray q{}, qd{};
      q[2] = height_ = from + by_m * (s - std::sin(2.0 * M_PI * s) / (2.0 * M_PI));
      qd[2] = s < 1.0 ? by_m / T * (1.0 - std::cos(2.0 * M_PI * s)) : 0.0;
      JointCommand command;
      command.robot = 0;
      command.position = q;
      command.velocity = qd;
      command.has_velocity = true;
      run(0.008, {command});
    }
  }
  Snapshot snapshot() const { return simulation_->make_snapshot(); }
  int partner(int part) const { return snapshot().components[static_cast<std::size_t>(part)].partner; }
  double z(int part) const { return snapshot().components[static_cast<std::size_t>(part)].p_WB.z(); }

  BoxCell cell_;
  int palm_ = -1, table_ = -1;
  double height_ = 0.0;
  std::optional<Simulation> simulation_;
  std::vector<WeakGrip> weak_;
};

INSTANTIATE_TEST_SUITE_P(Rules, GraspingTest, testing::Values(GraspRule::on_command, GraspRule::on_contact),
                         [](const auto& rule) {
                           return rule.param == GraspRule::on_command ? "OnCommand" : "OnContact";
                         });

TEST_P(GraspingTest, APartThatEntersClosedJawsIsNotHeld) {
  for (const auto algorithm :
       {InteractionAlgorithm::partner_search, InteractionAlgorithm::extended_substitute_force,
        InteractionAlgorithm::substitute_force}) {
    cell_ = BoxCell();
    SetUp();
    cell_.model().interaction.algorithm = algorithm;
    // Held between the jaws' upper ends; below it a post, 10 mm under the tips.
    const int held = cell_.part("P", 0.5, 1, {0.04, 0.06, 0.02}, at(0, 0, 0.475));
    const int post = cell_.part("Q", 0.5, 2, {0.01, 0.02, 0.03}, at(0.0, 0.0, 0.40));
    const int shelf = cell_.ground("H", {0.01, 0.2, 0.01}, at(0.015, 0.0, 0.465));
    height_ = 0.0;
    start();
    ASSERT_EQ(partner(held), shelf);
    run(1.0, {kClose});
    ASSERT_EQ(partner(held), palm_);
    lift(-0.02, 0.5);  // through the shelf: there is no contact between Parts and Grounds here
    EXPECT_EQ(partner(held), palm_);
    EXPECT_EQ(partner(post), table_) << to_string(algorithm);
    lift(0.02, 0.5);
    EXPECT_EQ(partner(post), table_) << to_string(algorithm);
    EXPECT_NEAR(z(post), 0.40, 1e-9);
    EXPECT_NEAR(z(held), 0.475, 1e-6);
  }
}

TEST_P(GraspingTest, JawsThatClosedOnNothingHoldNothing) {
  const int low = cell_.part("P", 0.5, 3, {0.06, 0.06, 0.03}, at(0, 0, 0.40));
  start();
  run(1.2, {kClose});
  Snapshot s = snapshot();
  EXPECT_NEAR(s.grippers[0].width_m, 0.0, 1e-12);
  EXPECT_TRUE(s.grippers[0].closed);
  EXPECT_TRUE(s.grippers[0].in_position);
  EXPECT_EQ(s.grippers[0].part, -1);
  EXPECT_EQ(s.grippers[0].force_N, 0.0);
  lift(-0.03, 1.0);
  EXPECT_EQ(partner(low), table_);
  run(0.1, {kClose});  // controllers repeat commands
  EXPECT_EQ(partner(low), table_);
  EXPECT_EQ(snapshot().grippers[0].part, -1);
  lift(0.1, 1.0);
  EXPECT_EQ(z(low), 0.40);
}

TEST_P(GraspingTest, PartsOutsideBothJawsAreReleasedWhenTheyStand) {
  // The narrow one beside the wide one, with a gap: it is between the jaws, but they never reach it.
  const int wide = cell_.part("W", 0.5, 3, {0.015, 0.08, 0.08}, at(-0.01, 0.0, 0.40));
  const int narrow = cell_.part("N", 0.5, 3, {0.015, 0.04, 0.08}, at(0.01, 0.0, 0.40));
  start();
  run(0.3, {kClose});
  EXPECT_EQ(partner(narrow), GetParam() == GraspRule::on_command ? palm_ : table_);
  EXPECT_EQ(snapshot().grippers[0].part, -1);
  run(0.5);
  EXPECT_EQ(partner(wide), palm_);
  EXPECT_EQ(partner(narrow), table_);
  const GripperSample gripper = snapshot().grippers[0];
  EXPECT_EQ(gripper.part, wide);
  EXPECT_EQ(gripper.force_N, 100.0);
  EXPECT_FALSE(gripper.in_position);
  EXPECT_FALSE(gripper.moving);
  EXPECT_NEAR(gripper.width_m, 0.08, 1e-6);
}

TEST_P(GraspingTest, PartsClampedTogetherAreHeldTogether) {
  // Three in a row from jaw to jaw, and one on the middle one that no way from jaw to jaw leads through.
  const int a = cell_.part("A", 0.2, 3, {0.03, 0.02, 0.06}, at(0.0, 0.0200, 0.40));
  const int b = cell_.part("B", 0.2, 3, {0.03, 0.02, 0.05}, at(0.0, 0.0, 0.40));
  const int c = cell_.part("C", 0.2, 3, {0.03, 0.02, 0.06}, at(0.0, -0.0200, 0.40));
  const int d = cell_.part("D", 0.2, 4, {0.03, 0.01, 0.03}, at(0.0, 0.0, 0.45));
  start();
  run(1.2, {kClose});
  for (const int part : {a, b, c}) EXPECT_EQ(partner(part), palm_) << part;
  EXPECT_NE(partner(d), palm_);
  EXPECT_EQ(snapshot().grippers[0].part, a);
}

TEST_P(GraspingTest, GripForceIsMeasuredWhileTheJawsMove) {
  cell_.part("P", 0.5, 3, {0.06, 0.08, 0.06}, at(0, 0, 0.40));
  start();
  EXPECT_TRUE(snapshot().grippers[0].in_position);
  run(0.3, {kClose});
  GripperSample gripper = snapshot().grippers[0];
  EXPECT_TRUE(gripper.closed);
  EXPECT_TRUE(gripper.moving);
  EXPECT_FALSE(gripper.in_position);
  EXPECT_EQ(gripper.part, -1);
  EXPECT_NEAR(gripper.width_m, 0.2 - 2 * 0.1 * 0.3, 1e-9);
  run(0.5);
  run(0.1, {kOpen});
  gripper = snapshot().grippers[0];
  EXPECT_FALSE(gripper.closed);
  EXPECT_TRUE(gripper.moving);
  EXPECT_EQ(gripper.part, -1);
}

TEST_P(GraspingTest, FrictionMustCarryWeightAndAcceleration) {
  // Default mu of 0.3: m (g + a) / (2 mu) of each jaw.
  cell_.model().grippers[0].max_force_N = 10.0;
  const double m = 0.5;
  const int part = cell_.part("P", m, 3, {0.06, 0.08, 0.06}, at(0, 0, 0.40));
  start();
  run(1.0, {kClose});
  EXPECT_EQ(simulation_->grip_load(0).part, part);
  EXPECT_NEAR(simulation_->grip_load(0).needed_N, m * kGravity_m_s2 / 0.6, 1e-6);
  EXPECT_EQ(simulation_->grip_load(0).force_N, 10.0);
  EXPECT_TRUE(weak_.empty());
  lift(0.10, 1.5);
  EXPECT_TRUE(weak_.empty());  // 9.42 N
  lift(0.10, 4.0);
  lift(0.10, 4.0);
  ASSERT_EQ(weak_.size(), 1U);  // 11.5 N at most; once for this grip
  EXPECT_EQ(weak_[0].part, part);
  EXPECT_NEAR(weak_[0].needed_N, 10.0, 0.05);
  EXPECT_EQ(partner(part), palm_);
}

TEST_P(GraspingTest, ACommandLimitsTheGripForce) {
  // m g / (2 mu) = 8.17 N of each jaw.
  cell_.model().grippers[0].max_force_N = 10.0;
  const int part = cell_.part("P", 0.5, 3, {0.06, 0.08, 0.06}, at(0, 0, 0.40));
  start();
  const auto close_with = [](double force_N) {
    return GripperCommand{0, {}, GripperAction::close, 0.0, force_N};
  };
  run(1.0, {close_with(6.0)});
  EXPECT_EQ(simulation_->grip_load(0).force_N, 6.0);
  EXPECT_EQ(snapshot().grippers[0].force_N, 6.0);
  lift(0.05, 0.5);
  ASSERT_EQ(weak_.size(), 1U);
  EXPECT_EQ(weak_[0].part, part);
  EXPECT_NEAR(weak_[0].needed_N, 0.5 * kGravity_m_s2 / 0.6, 0.5 * 0.5 / 0.6);

  std::vector<std::byte> bytes;
  ASSERT_EQ(simulation_->save_state(bytes), "");
  run(0.1, {close_with(9.0)});
  EXPECT_EQ(snapshot().grippers[0].force_N, 9.0);
  run(0.1, {close_with(0.0)});  // the gripper's own limit
  EXPECT_EQ(snapshot().grippers[0].force_N, 10.0);
  EXPECT_EQ(partner(part), palm_);
  ASSERT_EQ(simulation_->restore_state(bytes), "");
  EXPECT_EQ(snapshot().grippers[0].force_N, 6.0);
}

TEST_P(GraspingTest, ALoadAlongTheJawsRelievesOneOfThem) {
  const double m = 0.5, a = 2.0;
  cell_.part("P", m, 3, {0.06, 0.08, 0.06}, at(0, 0, 0.40));
  start();
  run(1.0, {kClose});
  lift(0.05, 1.0);
  double most = 0.0;
  for (double t = 0.0; t < 0.6; t += 0.008) {  // y = a t^2 / 2
    JointCommand command;
    command.robot = 0;
    command.position[2] = height_;
    command.position[1] = 0.5 * a * (t + 0.008) * (t + 0.008);
    command.velocity[1] = a * (t + 0.008);
    command.has_velocity = true;
    run(0.008, {command});
    if (t > 0.2) most = std::max(most, simulation_->grip_load(0).needed_N);
  }
  EXPECT_NEAR(most, 0.5 * (m * kGravity_m_s2 / 0.3 + m * a), 0.02);
}

TEST_P(GraspingTest, ASavedStateContinuesWithTheSameBits) {
  const int part = cell_.part("P", 0.5, 3, {0.06, 0.08, 0.06}, at(0, 0, 0.40));
  cell_.part("Q", 0.5, 3, {0.015, 0.02, 0.08}, at(0.045, 0.0, 0.40));
  start();
  for (const double when : {0.2, 0.6, 0.8}) {
    simulation_->reset();
    run(when, {kClose});
    std::vector<std::byte> bytes;
    ASSERT_EQ(simulation_->save_state(bytes), "");
    Simulation other(cell_.build());
    ASSERT_EQ(other.restore_state(bytes), "");
    for (int i = 0; i < 800; ++i) {
      ASSERT_TRUE(simulation_->step({}));
      ASSERT_TRUE(other.step({}));
    }
    EXPECT_EQ(other.state_hash(), simulation_->state_hash());
    EXPECT_EQ(other.make_snapshot().grippers[0].part, part);
    EXPECT_EQ(snapshot().grippers[0].part, part);
  }
}

}  // namespace
}  // namespace takt::test
