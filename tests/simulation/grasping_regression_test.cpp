// Gear on shaft, ring on pin, closed jaws lowered onto a pin, a grip that is too weak: at every level of
// detail everything that the scenario files demand holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

struct GraspingRun {
  HeadlessResult result;
  CellDescription cell;
  std::vector<Snapshot> history;  ///< every 8 ms

  int component(const std::string& name) const { return cell.find_component(name); }
  const Snapshot& at(double time_s) const {
    return *std::find_if(history.begin(), history.end(),
                         [time_s](const Snapshot& s) { return s.time_s >= time_s - 1e-9; });
  }
};

GraspingRun run_cell(const std::string& name, int level, const std::vector<std::string>& overrides = {}) {
  ScenarioOptions options;
  options.level_of_detail = level;
  options.overrides = overrides;
  const Scenario scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / (name + ".yaml"), options);
  Simulation simulation(build_cell(scenario));
  GraspingRun done;
  done.cell = simulation.description();
  HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  done.result = run_headless(simulation, scenario, headless, [&](const Simulation& s) {
    if (s.step_index() % 8 == 0) done.history.push_back(s.make_snapshot());
  });
  EXPECT_EQ(done.result.fault, "");
  for (const AssertionResult& demand : done.result.assertions)
    EXPECT_NE(demand.verdict, AssertionResult::Verdict::failed) << demand.name << ": " << demand.sentence;
  for (const Snapshot& s : done.history) EXPECT_GE(s.grippers[0].width_m, 0.0) << s.time_s;
  return done;
}

class GraspingCells : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Levels, GraspingCells, testing::Values(1, 2, 3),
                         [](const auto& level) { return "Lod" + std::to_string(level.param); });

/// While it carries; the part is 40 mm wide.
void expect_grip(const GraspingRun& done, const std::string& part, double max_force_N) {
  const GripperSample& before = done.at(3.9).grippers[0];
  EXPECT_FALSE(before.closed);
  EXPECT_TRUE(before.in_position);
  EXPECT_EQ(before.part, -1);
  EXPECT_NEAR(before.width_m, 0.070, 1e-4);
  const GripperSample& closing = done.at(4.1).grippers[0];
  EXPECT_TRUE(closing.closed);
  EXPECT_TRUE(closing.moving);
  EXPECT_FALSE(closing.in_position);
  EXPECT_EQ(closing.part, -1);
  const GripperSample& carrying = done.at(7.0).grippers[0];
  EXPECT_TRUE(carrying.closed);
  EXPECT_FALSE(carrying.moving);
  EXPECT_FALSE(carrying.in_position);
  EXPECT_EQ(carrying.part, done.component(part));
  EXPECT_NEAR(carrying.width_m, 0.040, 2e-4);
  EXPECT_NEAR(carrying.force_N, max_force_N, 0.01 * max_force_N);
  const GripperSample& after = done.history.back().grippers[0];
  EXPECT_FALSE(after.closed);
  EXPECT_TRUE(after.in_position);
  EXPECT_EQ(after.part, -1);
}

TEST_P(GraspingCells, AGearIsPutOnItsShaft) {
  const GraspingRun done = run_cell("gear_on_shaft", GetParam());
  expect_grip(done, "Gear", 100.0);
  for (const ConnectionChange& change : done.result.changes)
    EXPECT_TRUE(change.part != done.component("Shaft") || change.step == 0) << change.time_s;
  EXPECT_TRUE(done.result.weak_grips.empty());
}

TEST_P(GraspingCells, ARingIsPutOnItsPin) {
  const GraspingRun done = run_cell("ring_on_pin", GetParam());
  expect_grip(done, "Ring", 60.0);
  for (const ConnectionChange& change : done.result.changes)
    EXPECT_TRUE(change.part != done.component("Pin") || change.step == 0) << change.time_s;
}

TEST_P(GraspingCells, ClosedJawsLoweredOntoAPinHoldNothing) {
  const GraspingRun done = run_cell("closed_jaws", GetParam());
  const GripperSample& closed = done.at(2.9).grippers[0];
  EXPECT_TRUE(closed.closed);
  EXPECT_TRUE(closed.in_position);
  EXPECT_NEAR(closed.width_m, 0.0, 1e-4);
  for (const Snapshot& s : done.history) {
    EXPECT_EQ(s.grippers[0].part, -1) << s.time_s;
    EXPECT_EQ(s.components[static_cast<std::size_t>(done.component("Pin"))].partner, done.component("Table"))
        << s.time_s;
  }
}

TEST(GraspingCellsInDepth, ClosedJawsLoweredThroughAPinLeaveItBehind) {
  for (const int level : {1, 2}) {
    const GraspingRun done = run_cell("closed_jaws", level, {"controller.parameters.depth_m=0.02"});
    for (const Snapshot& s : done.history)
      EXPECT_EQ(s.components[static_cast<std::size_t>(done.component("Pin"))].partner,
                done.component("Table"))
          << s.time_s;
  }
}

TEST_P(GraspingCells, AGripThatIsTooWeakIsReported) {
  const GraspingRun done = run_cell("weak_grip", GetParam());
  const auto block = static_cast<std::size_t>(done.component("Block"));
  double highest = 0.0;
  for (const Snapshot& s : done.history) highest = std::max(highest, s.components[block].p_WB.z());
  if (GetParam() == 3) {
    EXPECT_LT(highest, 0.702);  // the jaws slide off
    EXPECT_TRUE(done.result.weak_grips.empty());
    return;
  }
  EXPECT_GT(highest, 0.79);
  ASSERT_EQ(done.result.weak_grips.size(), 1U);
  EXPECT_EQ(done.result.weak_grips[0].part, done.component("Block"));
  EXPECT_EQ(done.result.weak_grips[0].force_N, 15.0);
  ASSERT_EQ(done.result.grips.size(), 1U);
  // 3 kg x (9.80665 + 0.5) m/s^2 on two pads with a friction of 0.5, at the most.
  EXPECT_NEAR(done.result.grips[0].load.needed_N, 3.0 * (9.80665 + 0.5) / (2.0 * 0.5), 2.0);
  EXPECT_GE(done.result.grips[0].load.needed_N, 3.0 * 9.80665);
}

}  // namespace
}  // namespace takt
