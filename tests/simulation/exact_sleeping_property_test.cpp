// Parts at rest are left out without a bit of difference: whole runs with and without skipping.
#include <gtest/gtest.h>

#include <iostream>

#include "server/simulation/model/cell_model.h"
#include "tests/support/crowded_cell.h"
#include "tests/support/random_shapes.h"
#include "tests/support/snapshot_bits.h"

namespace takt {
namespace {

using test::CrowdedCell;
using test::expect_same_bits;

TEST(ExactSleeping, SkippingRestingPartsChangesNoBit) {
  CrowdedCell with(60, true);
  CrowdedCell without(60, false);
  Simulation a(with.model());
  Simulation b(without.model());
  Snapshot sa = a.make_snapshot(), sb = b.make_snapshot();
  bool carried = false;
  for (int i = 0; i < 4500; ++i) {
    ASSERT_TRUE(a.step(with.commands(a, 3.0)));
    ASSERT_TRUE(b.step(without.commands(b, 3.0)));
    ASSERT_EQ(a.state_hash(), b.state_hash()) << "step " << i;
    ASSERT_EQ(a.events().connection_changes.size(), b.events().connection_changes.size()) << "step " << i;
    if (i % 250 != 0) continue;
    a.read_snapshot(sa);
    b.read_snapshot(sb);
    expect_same_bits(sa, sb);
    carried = carried || sa.components[1].state == PartState::grasped;
  }
  EXPECT_TRUE(carried);
  EXPECT_EQ(b.statistics().part_steps_skipped, 0U);
  // Nearly all of the 58 Parts at rest are at rest from the first steps on.
  std::cout << "Part-steps skipped: " << a.statistics().part_steps_skipped << " of " << 60 * 4500 << "\n";
  EXPECT_GT(a.statistics().part_steps_skipped, 50U * 4400U);
}

TEST(ExactSleeping, RandomCellsHaveTheSameBits) {
  // Parts dropped onto tables and onto each other, at random places, turned, with and without feed-forward.
  constexpr InteractionAlgorithm kAlgorithms[] = {InteractionAlgorithm::partner_search,
                                                  InteractionAlgorithm::substitute_force,
                                                  InteractionAlgorithm::extended_substitute_force};
  for (unsigned seed = 0; seed < 36; ++seed) {
    const auto build = [&](bool skip) {
      test::Random random(100 + seed);
      test::BoxCell cell;
      cell.feed_forward(seed % 2 == 0);
      cell.model().interaction.algorithm = kAlgorithms[seed / 12];
      cell.model().interaction.exact_sleeping = skip;
      cell.ground("T", {1.0, 1.0, 0.05}, test::at(0.0, 0.0, -0.05));
      for (int i = 0; i < 25; ++i) {
        Pose pose = test::at(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), random.uniform(0.0, 0.3));
        if (i % 3 == 0) pose.R = random.rotation();
        cell.part("P" + std::to_string(i), random.uniform(0.05, 1.0), random.integer(1, 4),
                  {random.uniform(0.02, 0.2), random.uniform(0.02, 0.2), random.uniform(0.02, 0.1)}, pose);
      }
      return cell.build();
    };
    Simulation a(build(true));
    Simulation b(build(false));
    for (int i = 0; i < 1500; ++i) {
      ASSERT_EQ(a.step({}), b.step({}));
      ASSERT_EQ(a.state_hash(), b.state_hash()) << "seed " << seed << ", step " << i;
    }
    // Back to the start: the same again, with any caches.
    const std::uint64_t end = a.state_hash();
    a.reset();
    for (int i = 0; i < 1500; ++i) a.step({});
    EXPECT_EQ(a.state_hash(), end) << "seed " << seed;
    EXPECT_GT(a.statistics().mpr_skipped, 0U);
  }
}

TEST(ExactSleeping, SkippingRestingPartsChangesNoBitUnderAnyAlgorithm) {
  for (const InteractionAlgorithm algorithm :
       {InteractionAlgorithm::substitute_force, InteractionAlgorithm::extended_substitute_force}) {
    for (const bool feed_forward : {true, false}) {
      CrowdedCell with(30, true), without(30, false);
      const auto build = [&](const CrowdedCell& cell) {
        auto model = std::make_shared<CellModel>(*cell.model());
        model->interaction.algorithm = algorithm;
        model->interaction.weight_feed_forward = feed_forward;
        model->step_s = 5e-4;
        return model;
      };
      Simulation a(build(with));
      Simulation b(build(without));
      Snapshot sa = a.make_snapshot(), sb = b.make_snapshot();
      for (int i = 0; i < 5000; ++i) {
        ASSERT_TRUE(a.step(with.commands(a, 1.6)));
        ASSERT_TRUE(b.step(without.commands(b, 1.6)));
        ASSERT_EQ(a.state_hash(), b.state_hash()) << to_string(algorithm) << ", step " << i;
        ASSERT_EQ(a.events().connection_changes.size(), b.events().connection_changes.size()) << "step " << i;
        if (i % 250 != 0) continue;
        a.read_snapshot(sa);
        b.read_snapshot(sb);
        expect_same_bits(sa, sb);
      }
      EXPECT_GT(a.statistics().part_steps_skipped, 25U * 2500U) << to_string(algorithm);
    }
  }
}

/// A sample of each step, beside the only sample of a simulation that was restored from the same state.
TEST(KeptWrenches, ASampleDoesNotDependOnEarlierOnes) {
  for (const InteractionAlgorithm algorithm :
       {InteractionAlgorithm::partner_search, InteractionAlgorithm::substitute_force,
        InteractionAlgorithm::extended_substitute_force}) {
    CrowdedCell cell(30, true);
    auto model = std::make_shared<CellModel>(*cell.model());
    model->interaction.algorithm = algorithm;
    model->step_s = 5e-4;
    Simulation streamed(model);
    Snapshot each = streamed.make_snapshot();
    std::vector<std::byte> state;
    bool carried = false;
    for (int i = 0; i < 5000; ++i) {
      ASSERT_TRUE(streamed.step(cell.commands(streamed, 1.6)));
      streamed.read_snapshot(each);
      carried = carried || each.components[1].state == PartState::grasped;
      if (i % 40 != 0) continue;
      ASSERT_EQ(streamed.save_state(state), "");
      Simulation restored(model);
      ASSERT_EQ(restored.restore_state(state), "");
      Snapshot once = restored.make_snapshot();
      expect_same_bits(each, once);
    }
    EXPECT_TRUE(carried) << to_string(algorithm);
  }
}

TEST(ExactSleeping, CountsOfCallsEqualThoseOfTestingMovedPairsOnly) {
  // One Part falls past four at rest: only its pairs are tested.
  test::BoxCell cell;
  cell.ground("T", {1.0, 1.0, 0.05}, test::at(0.0, 0.0, -0.05));
  for (int i = 0; i < 4; ++i)
    cell.part("P" + std::to_string(i), 0.2, 3, {0.04, 0.04, 0.04}, test::at(0.1 * i - 0.2, 0.0, 0.0));
  cell.part("F", 0.2, 3, {0.04, 0.04, 0.04}, test::at(0.0, 0.8, 0.5));
  Simulation simulation(cell.build());
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(simulation.step({}));
  const SimulationStatistics before = simulation.statistics();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(simulation.step({}));
  const SimulationStatistics& after = simulation.statistics();
  EXPECT_EQ(after.part_steps_skipped - before.part_steps_skipped, 400U);
  EXPECT_EQ(after.mpr_calls, before.mpr_calls);             // no Part is near the falling one
  EXPECT_EQ(after.mpr_skipped - before.mpr_skipped, 400U);  // four contacts with the table stand
}

}  // namespace
}  // namespace takt
