// The three interaction algorithms: where they must agree, bit for bit; and chains and parallel connections
// against the closed forms (3.24), (3.25), (3.29).
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "server/contact/holding/connections.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"
#include "tests/support/constants.h"

namespace takt::test {
namespace {

constexpr std::array kAlgorithms{InteractionAlgorithm::substitute_force,
                                 InteractionAlgorithm::extended_substitute_force,
                                 InteractionAlgorithm::partner_search};
constexpr std::array kChains{InteractionAlgorithm::substitute_force,
                             InteractionAlgorithm::extended_substitute_force};

std::string name(InteractionAlgorithm algorithm) {
  return std::string(to_string(algorithm));
}
const ComponentSample& sample(const Snapshot& s, int id) {
  return s.components[static_cast<std::size_t>(id)];
}
Command grip(GripperAction action) {
  return GripperCommand{0, {}, action, 0.0, 0.0};
}
Command move_to(const JointArray& q, double period_s) {
  JointCommand command;
  command.robot = 0;
  command.period_s = period_s;
  command.position = q;
  return command;
}
void run(Simulation& simulation, int steps) {
  for (int i = 0; i < steps; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
}

TEST(InteractionAlgorithms, OnePartOnATableHasTheSameBitsUnderEveryAlgorithm) {
  for (const bool feed_forward : {true, false}) {
    std::vector<std::uint64_t> hashes;
    for (const InteractionAlgorithm algorithm : kAlgorithms) {
      BoxCell cell;
      cell.feed_forward(feed_forward).ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
      cell.model().interaction.algorithm = algorithm;
      cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0.01, 0.02, 0.05));  // falls onto it
      Simulation simulation(cell.build());
      run(simulation, 1000);
      EXPECT_EQ(sample(simulation.make_snapshot(), 1).partner, 0);
      hashes.push_back(simulation.state_hash());
    }
    EXPECT_EQ(hashes[0], hashes[2]);
    EXPECT_EQ(hashes[1], hashes[2]);
  }
}

TEST(InteractionAlgorithms, OnePartInAGripperHasTheSameBitsUnderEveryAlgorithm) {
  std::vector<std::uint64_t> hashes;
  for (const InteractionAlgorithm algorithm : kAlgorithms) {
    BoxCell cell;
    cell.model().interaction.algorithm = algorithm;
    const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
    const int part = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.0, 0, 0.40));
    Simulation simulation(cell.build());
    const Command commands[] = {grip(GripperAction::close), move_to({0.1, 0.05, 0.1, 0.4, -0.3, 0.2}, 0.5)};
    ASSERT_TRUE(simulation.step(commands));
    run(simulation, 800);
    EXPECT_EQ(sample(simulation.make_snapshot(), part).partner, palm);
    hashes.push_back(simulation.state_hash());
  }
  EXPECT_EQ(hashes[0], hashes[2]);
  EXPECT_EQ(hashes[1], hashes[2]);
}

TEST(InteractionAlgorithms, APickSwitchesFromTableToGripper) {  // Fig. 3.10
  std::vector<std::uint64_t> hashes;
  for (const InteractionAlgorithm algorithm : kAlgorithms) {
    SCOPED_TRACE(name(algorithm));
    BoxCell cell;
    cell.model().interaction.algorithm = algorithm;
    const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
    const int table = cell.ground("T", {1, 1, 0.1}, at(0, 0, 0.3));
    const int part = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.0, 0, 0.40));
    Simulation simulation(cell.build());
    run(simulation, 10);
    const Command close = grip(GripperAction::close);
    ASSERT_TRUE(simulation.step({&close, 1}));
    ASSERT_EQ(simulation.events().connection_changes.size(), 1U);
    EXPECT_EQ(simulation.events().connection_changes[0].from, table);
    EXPECT_EQ(simulation.events().connection_changes[0].to, palm);
    // The plain algorithm keeps hold of the table until the Part has left it.
    EXPECT_EQ(simulation.connections().size(), algorithm == InteractionAlgorithm::substitute_force ? 2U : 1U);
    const Command lift = move_to({0, 0, 0.05, 0, 0, 0}, 0.2);
    ASSERT_TRUE(simulation.step({&lift, 1}));
    run(simulation, 500);
    EXPECT_EQ(simulation.connections().size(), 1U);
    const ComponentSample end = sample(simulation.make_snapshot(), part);
    EXPECT_EQ(end.partner, palm);
    EXPECT_EQ(end.state, PartState::grasped);
    EXPECT_NEAR(end.p_WB.z(), 0.45, 1e-9);
    hashes.push_back(simulation.state_hash());
  }
  EXPECT_EQ(hashes[1], hashes[2]);
}

struct Chain {
  std::shared_ptr<const CellModel> model;
  int table, b, c;
};
/// C (0.5 kg) on B (1 kg) on the table; C off the middle of B by `offset` along x.
Chain chain(InteractionAlgorithm algorithm, bool feed_forward, double offset) {
  BoxCell cell;
  cell.step(2e-4).feed_forward(feed_forward);
  cell.model().interaction.algorithm = algorithm;
  Chain r{};
  r.table = cell.ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
  r.b = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  r.c = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(offset, 0, 0.06));
  r.model = cell.build();
  return r;
}

TEST(InteractionAlgorithms, SagOfAChainAddsUp) {  // (3.24), (3.25)
  for (const InteractionAlgorithm algorithm : kChains) {
    const Chain r = chain(algorithm, false, 0.0);
    Simulation simulation(r.model);
    run(simulation, 5000);
    const Snapshot s = simulation.make_snapshot();
    EXPECT_EQ(sample(s, r.c).partner, r.b);
    EXPECT_EQ(sample(s, r.b).partner, r.table);
    const double k_bt = translational_stiffness(1.0, kGravity_m_s2, 1e-4);
    const double k_cb = translational_stiffness(0.5, kGravity_m_s2, 1e-4);
    const double sag_b = 1.5 * kGravity_m_s2 / k_bt;
    EXPECT_NEAR(sample(s, r.b).p_WB.z(), -sag_b, 1e-10) << name(algorithm);
    EXPECT_NEAR(sample(s, r.c).p_WB.z(), 0.06 - (sag_b + 0.5 * kGravity_m_s2 / k_cb), 1e-10);
  }
}

TEST(InteractionAlgorithms, FeedForwardCarriesAChainWithItsMoment) {
  // C sits 60 mm off the middle of B: no Part sags or tilts, and each connection carries the load of its
  // Part, moment included.
  for (const InteractionAlgorithm algorithm : kChains) {
    const Chain r = chain(algorithm, true, 0.06);
    Simulation simulation(r.model);
    run(simulation, 2000);
    const Snapshot s = simulation.make_snapshot();
    EXPECT_LT(std::abs(sample(s, r.b).p_WB.z()), 1e-13) << name(algorithm);
    EXPECT_LT(std::abs(sample(s, r.c).p_WB.z() - 0.06), 1e-13);
    EXPECT_LT(sample(s, r.b).q_WB.angularDistance(Quat::Identity()), 1e-9);
    ASSERT_EQ(simulation.connections().size(), 2U);
    const Wrench on_b = simulation.pair_wrench(simulation.connections()[0]);
    const Wrench on_c = simulation.pair_wrench(simulation.connections()[1]);
    EXPECT_NEAR(on_b.f.z(), 1.5 * kGravity_m_s2, 1e-9);
    EXPECT_NEAR(on_b.t.y(), -0.06 * 0.5 * kGravity_m_s2, 1e-9);  // against (0.06, 0, z) x (0, 0, -m g)
    EXPECT_NEAR(on_c.f.z(), 0.5 * kGravity_m_s2, 1e-9);
    EXPECT_NEAR(on_c.t.norm(), 0.0, 1e-9);
    // The table feels both weights where they are.
    const Wrench& on_table = sample(s, r.table).F_Bo_W;
    EXPECT_NEAR(on_table.f.z(), -1.5 * kGravity_m_s2, 1e-9);
    EXPECT_NEAR(on_table.t.y(), 0.06 * 0.5 * kGravity_m_s2, 1e-9);
  }
}

TEST(InteractionAlgorithms, FeedForwardHoldsAChainInAGripperInAnyPose) {
  for (const InteractionAlgorithm algorithm : kChains) {
    SCOPED_TRACE(name(algorithm));
    BoxCell cell;
    cell.step(2e-4);
    cell.model().interaction.algorithm = algorithm;
    const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
    const int b = cell.part("B", 1.0, 4, {0.06, 0.08, 0.06}, at(0.0, 0, 0.40));
    const int c = cell.part("C", 0.5, 3, {0.06, 0.06, 0.04}, at(0.01, 0.02, 0.36));  // hangs below it
    Simulation simulation(cell.build());
    const Command close = grip(GripperAction::close);
    ASSERT_TRUE(simulation.step({&close, 1}));
    const auto in_palm = [&](int id) {
      const Snapshot s = simulation.make_snapshot();
      const Pose X_WG = Pose::from_quaternion(sample(s, palm).p_WB, sample(s, palm).q_WB);
      return Vec3(X_WG.inverse() * sample(s, id).p_WB);
    };
    const Vec3 b_before = in_palm(b), c_before = in_palm(c);
    EXPECT_EQ(sample(simulation.make_snapshot(), c).partner, b);
    const Command turn = move_to({0, 0, 0, 2.5, 0, 0.4}, 3.0);
    ASSERT_TRUE(simulation.step({&turn, 1}));
    run(simulation, 20000);
    EXPECT_LT((in_palm(b) - b_before).norm(), 1e-8);
    EXPECT_LT((in_palm(c) - c_before).norm(), 1e-8);
    const Wrench& load = sample(simulation.make_snapshot(), palm).F_Bo_W;
    EXPECT_NEAR(load.f.z(), -1.5 * kGravity_m_s2, 1e-9);
  }
}

TEST(InteractionAlgorithms, ParallelConnectionsAddTheirStiffness) {  // (3.28), (3.29)
  // P on two Parts in the same place: two equal springs hold it, each of which carries half.
  for (const InteractionAlgorithm algorithm : kChains) {
    BoxCell cell;
    cell.step(2e-4).feed_forward(false);
    cell.model().interaction.algorithm = algorithm;
    cell.ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
    const int b = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
    const int o = cell.part("O", 1.0, 3, {0.2, 0.1, 0.06}, at(0, 0, 0));
    const int p = cell.part("P", 0.3, 2, {0.03, 0.03, 0.08}, at(0, 0, 0.06));
    Simulation simulation(cell.build());
    run(simulation, 5000);
    EXPECT_EQ(simulation.connections().size(), 5U);  // P-B, P-O, O-B, both on the table
    const Snapshot s = simulation.make_snapshot();
    const double k_p = translational_stiffness(0.3, kGravity_m_s2, 1e-4);
    const double k_b = translational_stiffness(1.0, kGravity_m_s2, 1e-4);
    const double sag_b = (1.0 + 0.5 * 0.3) * kGravity_m_s2 / k_b;
    EXPECT_NEAR(sample(s, b).p_WB.z(), -sag_b, 1e-10) << name(algorithm);
    EXPECT_NEAR(sample(s, o).p_WB.z(), -sag_b, 1e-10);
    EXPECT_NEAR(sample(s, p).p_WB.z(), 0.06 - sag_b - 0.3 * kGravity_m_s2 / (k_p + k_p), 1e-10);
  }
}

TEST(InteractionAlgorithms,
     TheExtendedAlgorithmLimitsAPartToOneGround) {  // 3.4.2: limit and prioritize the connections
  const auto sag = [](InteractionAlgorithm algorithm) {
    BoxCell cell;
    cell.step(2e-4).feed_forward(false);
    cell.model().interaction.algorithm = algorithm;
    cell.ground("T1", {1, 1, 0.1}, at(-0.5, 0, -0.1));
    cell.ground("T2", {1, 1, 0.1}, at(0.5, 0, -0.1));
    const int b = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
    Simulation simulation(cell.build());
    run(simulation, 3000);
    return -sample(simulation.make_snapshot(), b).p_WB.z();
  };
  EXPECT_NEAR(sag(InteractionAlgorithm::substitute_force), 0.5e-4, 1e-10);
  EXPECT_NEAR(sag(InteractionAlgorithm::extended_substitute_force), 1e-4, 1e-10);
  EXPECT_NEAR(sag(InteractionAlgorithm::partner_search), 1e-4, 1e-10);
}

TEST(InteractionAlgorithms, AFreeClusterFallsAsOneAndIsCaughtWithFullStiffness) {
  // A light plate with heavy cubes that also touch each other: with full constants the fastest mode would be
  // far beyond the step. On the table below, the cluster hangs on full constants again.
  for (const InteractionAlgorithm algorithm : kChains) {
    SCOPED_TRACE(name(algorithm));
    BoxCell cell;
    cell.step(1e-3);
    cell.model().interaction.algorithm = algorithm;
    const int plate = cell.part("plate", 0.02, 4, {0.1, 0.1, 0.005}, at(0, 0, 3.0));
    std::vector<int> cubes;
    for (int i = 0; i < 16; ++i) {
      cubes.push_back(cell.part("P" + std::to_string(i), 0.1, 3, {0.02, 0.02, 0.02},
                                at(-0.03 + 0.0201 * (i % 4), -0.03 + 0.0201 * (i / 4), 3.005)));
    }
    Simulation simulation(cell.build());
    run(simulation, 500);
    EXPECT_EQ(simulation.connections().size(), 16U + 24U + 18U);  // plate, sides, edges
    const Snapshot s = simulation.make_snapshot();
    const double fall = 0.5 * kGravity_m_s2 * 0.25;
    EXPECT_NEAR(sample(s, plate).p_WB.z(), 3.0 - fall, 1e-9);
    EXPECT_EQ(sample(s, plate).partner, -1);
    for (const int cube : cubes) {
      EXPECT_EQ(sample(s, cube).partner, plate);
      EXPECT_NEAR(sample(s, cube).p_WB.z(), 3.005 - fall, 1e-9);
    }
    for (const PairConnection& pair : simulation.connections()) EXPECT_LT(pair.connection.softening, 1.0);

    BoxCell pair;
    pair.step(2e-4).feed_forward(false);
    pair.model().interaction.algorithm = algorithm;
    pair.ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
    const int b = pair.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0.05));
    const int c = pair.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0, 0, 0.11));
    Simulation caught(pair.build());
    run(caught, 20);
    ASSERT_EQ(caught.connections().size(), 1U);
    EXPECT_LT(caught.connections()[0].connection.softening, 1.0);
    run(caught, 10000);
    ASSERT_EQ(caught.connections().size(), 2U);
    for (const PairConnection& closed : caught.connections()) EXPECT_EQ(closed.connection.softening, 1.0);
    const Snapshot end = caught.make_snapshot();
    EXPECT_LT(sample(end, b).V_WB.v.norm(), 1e-9);
    EXPECT_NEAR(caught.pair_wrench(caught.connections()[0]).f.z(), 1.5 * kGravity_m_s2, 1e-6);
    EXPECT_EQ(sample(end, c).partner, b);
  }
}

}  // namespace
}  // namespace takt::test
