// Groups of parts at rest in surface contact sleep, without a visible effect on poses.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

const std::string kAwake = "sleeping.method=exact";

void expect_same(const test::BlockRun& a, const test::BlockRun& b, double bound_m) {
  ASSERT_EQ(a.result.fault, "");
  ASSERT_EQ(b.result.fault, "");
  for (const ScenarioPart& part : a.scenario.parts) {
    const PoseError error =
        pose_error(a.sample(a.result.final_state, part.name), b.pose(b.result.final_state, part.name));
    EXPECT_LE(error.position_m, bound_m) << part.name;
    EXPECT_LE(error.angle_rad, 10.0 * bound_m) << part.name;
  }
}

TEST(ContactSleeping, AStackSleepsWithinTheBoundAndMostStepsCostNothing) {
  const test::BlockRun sleeping = test::run_block_scenario("contact/stack_of_ten");
  const test::BlockRun awake = test::run_block_scenario("contact/stack_of_ten", {kAwake});
  expect_same(sleeping, awake, 1e-9);
  EXPECT_EQ(awake.result.statistics.part_steps_skipped, 0U);
  EXPECT_GE(sleeping.result.statistics.part_steps_skipped, 8U * sleeping.result.statistics.steps);
  // Reports still contain the forces between sleeping Parts.
  EXPECT_NEAR(sleeping.sample(sleeping.result.final_state, "S1").F_Bo_W.f.z(),
              awake.sample(awake.result.final_state, "S1").F_Bo_W.f.z(), 1e-3);
}

TEST(ContactSleeping, TheSameEveryTime) {
  const test::BlockRun a = test::run_block_scenario("contact/drop");
  const test::BlockRun b = test::run_block_scenario("contact/drop");
  EXPECT_GT(a.result.statistics.part_steps_skipped, 0U);
  EXPECT_EQ(a.result.final_state.state_hash, b.result.final_state.state_hash);
}

TEST(ContactSleeping, AStackWakesBeforeSomethingHitsIt) {
  // The uppermost slab, a light one, falls onto the others, which sleep before it arrives at 2.8 m/s.
  const std::vector<std::string> fall{"parts.S10.pose.position_m=[0, 0, 0.58]", "parts.S10.mass_kg=0.02",
                                      "duration_s=1.5"};
  std::vector<std::string> awake = fall;
  awake.push_back(kAwake);
  std::size_t still = 0;
  double fastest_m_per_s = 0.0;
  const test::BlockRun a =
      test::run_block_scenario("contact/stack_of_ten", fall, [&](const CellModel& cell, const Snapshot& s) {
        const auto of = [&](const char* name) {
          return s.components[static_cast<std::size_t>(cell.description.find_component(name))];
        };
        if (s.time_s > 0.2 && s.time_s < 0.28 && of("S1").V_WB.v.norm() < 1e-7) ++still;
        if (s.time_s > 0.28) fastest_m_per_s = std::max(fastest_m_per_s, of("S1").V_WB.v.norm());
      });
  EXPECT_GT(still, 0U);
  EXPECT_GT(fastest_m_per_s, 1e-5);  // the lowest slab feels it
  EXPECT_GT(a.result.statistics.part_steps_skipped, 9U * 10U);
  expect_same(a, test::run_block_scenario("contact/stack_of_ten", awake), 1e-4);
}

TEST(ContactSleeping, WhatAGripperTakesWakesInTime) {
  const test::BlockRun a = test::run_block_scenario("contact/grasp_and_lift");
  const test::BlockRun b = test::run_block_scenario("contact/grasp_and_lift", {kAwake});
  EXPECT_GT(a.result.statistics.part_steps_skipped, 0U);
  expect_same(a, b, 1e-6);
}

TEST(ContactSleeping, ReferenceSolversKeepEverybodyAwake) {
  const test::BlockRun a =
      test::run_block_scenario("contact/drop", {"solver.method=cvode", "solver.tolerance=1e-6"});
  EXPECT_EQ(a.result.fault, "");
  EXPECT_EQ(a.result.statistics.part_steps_skipped, 0U);
}

}  // namespace
}  // namespace takt
