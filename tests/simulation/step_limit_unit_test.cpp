// Steps that are too long for the substitute forces, known when a cell is loaded; explicit methods at
// contact.
#include "server/simulation/step/step_limit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::shared_ptr<const CellModel> blocks(const std::vector<std::string>& overrides, int level = 1) {
  ScenarioOptions options;
  options.level_of_detail = level;
  options.overrides = overrides;
  return load_cell(std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", options);
}

std::string refusal(const std::vector<std::string>& overrides, int level = 1) {
  try {
    blocks(overrides, level);
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "";
}

std::string note(const CellModel& cell) {
  for (const ImportNote& each : cell.import_notes)
    if (each.component == "solver") return each.sentence;
  return "";
}

TEST(StepLimit, TheLimitIsThatOfTheOscillator) {
  const double w = std::sqrt(9.80665 / 1e-4);
  EXPECT_NEAR(longest_stable_step_s({"rk2"}, w * w, 2.0 * w), 2.0 / w, 1e-8);
  EXPECT_NEAR(longest_stable_step_s({"implicit"}, w * w, 2.0 * w), 2.0 / w, 1e-8);
  // Real roots of |1 + z + z^2/2 + z^3/6 + z^4/24| = 1.
  EXPECT_NEAR(longest_stable_step_s({"rk4"}, w * w, 2.0 * w), 2.785293563 / w, 1e-8);
  // Over-damped: the faster root counts.
  EXPECT_NEAR(longest_stable_step_s({"rk2"}, 1.0, 1000.0), 2.0 / 999.999, 1e-7);
  for (const char* solver : {"rosenbrock", "cvode", "esdirk", "ida"})
    EXPECT_TRUE(std::isinf(longest_stable_step_s({solver}, w * w, 2.0 * w))) << solver;
}

// The thesis: 5 ms works, 6 ms breaks; ours holds up to 2 / w and places roughly from 5.5 ms on.
TEST(StepLimit, TheLimitOfTheBlockAssemblyIsCheckedAtLoad) {
  EXPECT_EQ(note(*blocks({"solver.step_s=0.005"})), "");
  EXPECT_THAT(note(*blocks({"solver.step_s=0.006"})), HasSubstr("close to its limit of 6.39 ms"));
  EXPECT_THAT(refusal({"solver.step_s=0.0064"}),
              AllOf(HasSubstr("solver.step_s: found 6.4 ms with rk2"), HasSubstr("allowed: at most 6.39 ms"),
                    HasSubstr("rosenbrock")));
  EXPECT_NE(refusal({"solver.step_s=0.01"}), "");
  EXPECT_NE(refusal({"solver.step_s=0.01", "solver.method=implicit"}), "");
  EXPECT_EQ(refusal({"solver.step_s=0.01", "solver.method=rosenbrock"}), "");
  EXPECT_EQ(refusal({"solver.step_s=0.0064", "solver.method=rk4"}), "");
}

TEST(StepLimit, ExplicitMethodsAreRefusedForSurfaceContact) {
  EXPECT_THAT(refusal({"solver.method=rk2"}, 3), AllOf(HasSubstr("'rk2'"), HasSubstr("rosenbrock")));
  EXPECT_THAT(refusal({"solver.contact.method=rk4"}, 3), AllOf(HasSubstr("rk4"), HasSubstr("rosenbrock")));
  EXPECT_EQ(blocks({"solver.method=rk2"})->contact_solver.name, kAutomaticSolver) << "the default";
}

TEST(StepLimit, ALevelWhoseStepIsTooLongIsRefused) {
  Simulation simulation(blocks({"solver.step_s=0.008"}, 3));
  ASSERT_EQ(simulation.solver().name, kAutomaticSolver);
  EXPECT_THAT(simulation.set_level_of_detail(-1, 1), HasSubstr("allowed: at most 6.39 ms"));
  EXPECT_EQ(simulation.solver().name, kAutomaticSolver);
  ASSERT_TRUE(simulation.step({})) << simulation.fault();
}

// The communication step is that of surface contact, 8 ms; rk2 keeps the 1 ms of `solver.step_s`.
TEST(StepLimit, ALevelWithShorterStepsDividesTheCommunicationStep) {
  Simulation simulation(blocks({"solver.contact.step_s=0.008"}, 3));
  ASSERT_EQ(simulation.description().step_s, 0.008);
  Snapshot before = simulation.make_snapshot(), after = before;
  simulation.read_snapshot(before);
  for (const int level : {1, 2}) {
    ASSERT_EQ(simulation.set_level_of_detail(-1, level), "");
    EXPECT_EQ(simulation.solver().name, "rk2");
    const std::uint64_t steps = simulation.statistics().solver.steps;
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(simulation.step({})) << simulation.fault();
    EXPECT_EQ(simulation.statistics().solver.steps - steps, 400U);
    simulation.read_snapshot(after);
    EXPECT_EQ(after.time_s - before.time_s, level * 0.4);
    for (std::size_t i = 0; i < after.components.size(); ++i)
      EXPECT_LE((after.components[i].p_WB - before.components[i].p_WB).norm(), 1e-4) << i;
  }
}

}  // namespace
}  // namespace takt
