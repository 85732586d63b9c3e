// The block assembly by two robots with detailed drives (thesis 5.3): parts end at their places in spite of
// motors, gears and friction between command and arm, and a solver of another kind agrees.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "server/headless/report.h"
#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

using test::BlockRun;

TEST(BlockKr16, DetailedDrivesAssembleTheBlocks) {
  std::vector<std::array<double, 6>> largest_effort, least_effort;
  bool detailed = true;
  const auto observe = [&](const CellModel& cell, const Snapshot& snapshot) {
    const std::size_t robots = cell.description.robots.size();
    if (largest_effort.empty()) {
      constexpr double kNone = std::numeric_limits<double>::infinity();
      largest_effort.assign(robots, {-kNone, -kNone, -kNone, -kNone, -kNone, -kNone});
      least_effort.assign(robots, {kNone, kNone, kNone, kNone, kNone, kNone});
    }
    for (std::size_t r = 0; r < robots; ++r) {
      for (std::size_t j = 0; j < 6; ++j) {
        const double effort = snapshot.robots[r].effort[j];
        largest_effort[r][j] = std::max(largest_effort[r][j], effort);
        least_effort[r][j] = std::min(least_effort[r][j], effort);
        detailed = detailed && snapshot.robots[r].drives[j].has_motor;
      }
    }
  };
  const BlockRun r = test::run_block_scenario("block_assembly_kr16", {}, observe);
  ASSERT_EQ(r.result.fault, "");
  EXPECT_TRUE(detailed);
  EXPECT_EQ(r.lost_part_steps, 0U);
  EXPECT_LE(max_position_error_m(r.scenario, r.cell->description, r.result.final_state),
            r.scenario.expected_tolerance_m);
  // Seated in each other as on the drawings, after every placement and not only at the end.
  EXPECT_LT((r.relative(r.mark(20.5), "P", "O") - test::kP_in_O).norm(), 1e-4);
  EXPECT_LT((r.relative(r.mark(20.5), "C", "B") - test::kC_in_B).norm(), 1e-4);
  EXPECT_LT((r.relative(r.mark(27.0), "O", "B") - test::kO_in_B).norm(), 1e-4);

  ASSERT_EQ(largest_effort.size(), 2U);
  for (std::size_t robot = 0; robot < 2; ++robot) {
    const ArmModel& arm = r.cell->description.robots[robot].arm;
    for (std::size_t j = 0; j < 6; ++j) {
      const double peak = std::max(largest_effort[robot][j], -least_effort[robot][j]);
      EXPECT_LT(peak, arm.joints[j].max_effort) << robot << ' ' << j;
      EXPECT_GT(peak, 0.0) << robot << ' ' << j;
    }
    // Axis 3 holds forearm, wrist and gripper, which always lean out to the same side: links 3 to 6 and the
    // gripper (63 kg) with their centre between 0.15 and 0.35 m from it.
    EXPECT_LT(largest_effort[robot][2], -63.0 * test::kGravity_m_s2 * 0.15);
    EXPECT_GT(least_effort[robot][2], -63.0 * test::kGravity_m_s2 * 0.35);
  }
}

TEST(BlockKr16, TheRunAgreesWithASolverWithErrorControl) {
  const auto run = [](const std::vector<std::string>& overrides) {
    return test::run_block_scenario("block_assembly_kr16", overrides);
  };
  const BlockRun fixed = run({}), again = run({});
  const BlockRun controlled = run({"solver.method=cvode", "solver.tolerance=1e-6"});
  ASSERT_EQ(controlled.result.fault, "");
  EXPECT_EQ(fixed.result.final_state.state_hash, again.result.final_state.state_hash);
  EXPECT_GT(fixed.result.statistics.solver.mode_switches, 100U) << "friction that sticks and slides";
  for (const char* part : {"P", "C", "O", "B"}) {
    EXPECT_LT((fixed.pose(fixed.result.final_state, part).p -
               controlled.pose(controlled.result.final_state, part).p)
                  .norm(),
              2e-6)
        << part;
  }
  for (std::size_t robot = 0; robot < 2; ++robot) {
    for (std::size_t j = 0; j < 6; ++j) {
      EXPECT_NEAR(fixed.result.final_state.robots[robot].position[j],
                  controlled.result.final_state.robots[robot].position[j], 5e-6)
          << robot << ' ' << j;
    }
  }
}

}  // namespace
}  // namespace takt
