// States of the block scenarios, saved and restored at every level of detail: the same bits afterwards.
#include <gtest/gtest.h>

#include <filesystem>

#include "server/headless/in_process_controller.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/contact_scene.h"
#include "tests/support/state_runs.h"

namespace takt::test {
namespace {

/// 0: that of the scenario.
void set_level(Simulation& simulation, int level) {
  if (level == 0) return;
  EXPECT_EQ(simulation.set_level_of_detail(-1, level), "");
}

struct Cell {
  Cell(const std::string& name, const std::vector<std::string>& overrides) {
    ScenarioOptions options;
    options.overrides = overrides;
    scenario =
        read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / (name + ".yaml"), options);
    model = build_cell(scenario);
  }
  /// The program's commands in a run at this level of detail.
  StepCommands commands(int level, double duration_s) const {
    Simulation simulation(model);
    set_level(simulation, level);
    InProcessController controller(scenario.controller_program.string(), simulation);
    StepCommands result;
    while (simulation.time_s() < duration_s - 1e-9) {
      const auto commands = controller.commands(simulation);
      result.emplace_back(commands.begin(), commands.end());
      EXPECT_TRUE(simulation.step(result.back())) << simulation.fault();
      if (!simulation.fault().empty()) break;
    }
    return result;
  }
  Scenario scenario;
  std::shared_ptr<const CellModel> model;
};

struct SceneTrial {
  std::string scenario;
  std::vector<std::string> overrides;
  int level;  ///< 0: that of the scenario
  double duration_s;
  std::vector<std::size_t> save_at;
  std::size_t go_on;
  std::string name;
};

class SavedScenario : public testing::TestWithParam<SceneTrial> {};

TEST_P(SavedScenario, ASavedScenarioContinuesWithTheSameBits) {
  const SceneTrial& trial = GetParam();
  const Cell cell(trial.scenario, trial.overrides);
  check_restored_runs(cell.model, cell.commands(trial.level, trial.duration_s), trial.save_at, trial.go_on,
                      [&](Simulation& simulation) { set_level(simulation, trial.level); });
}

// P is gripped at 3.9 s and lifted, C at 6 s; set-points come every 8 ms.
INSTANTIATE_TEST_SUITE_P(
    Scenarios, SavedScenario,
    testing::Values(
        SceneTrial{"block_assembly", {}, 1, 42.0, {0, 3913, 6500, 21003, 33333, 41500}, 3000, "level_1"},
        SceneTrial{"block_assembly", {"solver.method=rosenbrock"}, 1, 8.0, {3913, 6500}, 1500, "rosenbrock"},
        SceneTrial{"block_assembly", {}, 2, 8.0, {3, 3913, 4501, 6500}, 1000, "level_2"},
        SceneTrial{
            "block_assembly", {"solver.method=rosenbrock"}, 2, 5.0, {3913, 4501}, 500, "level_2_rosenbrock"},
        SceneTrial{"block_assembly", {"solver.method=cvode"}, 2, 4.5, {1003, 3913}, 500, "level_2_cvode"},
        SceneTrial{"block_assembly_kr16", {}, 0, 10.0, {1003, 4444, 7001}, 1500, "kr16"},
        SceneTrial{"block_disassembly", {}, 0, 12.0, {1003, 6444, 9001}, 1500, "disassembly"}),
    [](const auto& test) { return test.param.name; });

TEST(SavedContact, ASavedBlockAssemblyAtLevel3ContinuesWithTheSameBits) {
  const Cell cell("block_assembly", {"solver.contact.step_s=0.001"});
  check_restored_runs(cell.model, cell.commands(3, 5.2), {1003, 3913, 4501}, 600,
                      [](Simulation& simulation) { set_level(simulation, 3); });
}

// A patch is held over several steps (PolygonalContact::hold): it is part of the state.
TEST(SavedContact, ASavedNutContinuesToTurnWithTheSameBits) {
  for (const char* solver : {"implicit", "rosenbrock", "automatic"}) {
    const Cell cell("contact/nut_runs_down", {std::string("solver.method=") + solver});
    check_restored_runs(cell.model, StepCommands(60), {1, 27, 41}, 12);
  }
}

class SavedScene : public testing::TestWithParam<std::string> {};
TEST_P(SavedScene, SpringsAndSolverContinueWithTheSameBits) {
  for (const char* law : {"regularised", "stick"}) {
    const auto model = library_scene(GetParam(), {std::string("contact.defaults.friction_law=") + law});
    check_restored_runs(model, StepCommands(500), {0, 101, 250, 333}, 150);
    const auto by_default = library_scene(
        GetParam(), {std::string("contact.defaults.friction_law=") + law, "solver.method=automatic"});
    check_restored_runs(by_default, StepCommands(500), {0, 101, 250, 333}, 150);
  }
}
INSTANTIATE_TEST_SUITE_P(Scenes, SavedScene, testing::Values("incline", "sliding_block", "stack_of_ten"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace takt::test
