// Cells exported as FMUs and imported again: the bits of the same cell that runs here, states, several instances, refusals.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "server/fmu/standard/fmi2FunctionTypes.h"
#include "server/fmu_export/exporter.h"
#include "server/headless/in_process_controller.h"
#include "server/scenario/scenario_reader.h"
#include "tests/support/fmu_cell.h"

namespace takt {
namespace {

using test::FmuCell;
using testing::HasSubstr;

const std::filesystem::path kCellLibrary =
    std::filesystem::path(TAKT_BIN_DIR).parent_path() / "lib/takt/takt_cell.so";
const std::string kScenarios = std::string(TAKT_CONFIG_DIR) + "/scenarios/";

FmuExportOptions options_for(const std::filesystem::path& file, int version) {
  FmuExportOptions options;
  options.version = version;
  options.library = kCellLibrary;
  options.file = file;
  return options;
}

class ExportedCell : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Versions, ExportedCell, testing::Values(2, 3));

TEST_P(ExportedCell, WithItsRobotProgramHasTheBitsOfTheCell) {
  const Scenario scenario = read_scenario(kScenarios + "block_assembly.yaml");
  const test::TemporaryDirectory directory;
  FmuExportOptions options = options_for(directory / "block.fmu", GetParam());
  options.outputs = {"state_hash*", "Robot1.q[*]"};
  export_fmu(scenario, options);
  FmuCell exported(directory / "block.fmu", "memory_MiB: 4096", scenario.step_s);
  Simulation simulation(build_cell(scenario));
  InProcessController controller(scenario.controller_program.string(), simulation,
                                 scenario.program_parameters);
  for (int i = 0; i < 400; ++i) {
    ASSERT_TRUE(exported.step());
    ASSERT_TRUE(simulation.step(controller.commands(simulation)));
    ASSERT_EQ(exported.value("state_hash_1"), static_cast<double>(simulation.state_hash() & 0xffffffffU))
        << i << exported.notices();
    ASSERT_EQ(exported.value("state_hash_2"), static_cast<double>(simulation.state_hash() >> 32U)) << i;
  }
  Snapshot snapshot = simulation.make_snapshot();
  EXPECT_EQ(exported.value("Robot1_q_1"), snapshot.robots[0].position[0]);
  // The robot has moved.
  EXPECT_NE(snapshot.robots[0].position[0], scenario.robots[0].initial_joints_rad[0]);
  // Lua has no state that can be saved.
  std::vector<std::byte> state;
  EXPECT_THAT(exported.simulation().save_state(state), HasSubstr("cannot be saved"));
}

TEST_P(ExportedCell, FollowsItsInputsAndSavesItsState) {
  ScenarioOptions without_program;
  without_program.overrides = {"controller={}"};
  const Scenario scenario = read_scenario(kScenarios + "block_assembly.yaml", without_program);
  ASSERT_TRUE(scenario.controller_program.empty());
  const test::TemporaryDirectory directory;
  FmuExportOptions options = options_for(directory / "block.fmu", GetParam());
  options.inputs = {"Robot1.q_set[1]", "*.close"};
  options.outputs = {"state_hash*", "Robot1.q[1]", "*.width"};
  const FmuExportResult result = export_fmu(scenario, options);
  ASSERT_GE(result.inputs.size(), 2U);
  // Ten steps of the cell for one of the FMU.
  const std::string keys = "memory_MiB: 4096";
  FmuCell exported(directory / "block.fmu", keys, 10 * scenario.step_s),
      other(directory / "block.fmu", keys, 10 * scenario.step_s);
  const double start = exported.value("Robot1_q_1");
  EXPECT_EQ(exported.value("Robot1_q_set_1"), start);
  for (int i = 1; i <= 50; ++i) {
    exported.command("Robot1_q_set_1", start + 0.001 * i);
    ASSERT_TRUE(exported.step());
  }
  EXPECT_NEAR(exported.value("Robot1_q_1"), start + 0.05, 1e-6) << exported.notices();
  std::vector<std::byte> state;
  ASSERT_EQ(exported.simulation().save_state(state), "");
  ASSERT_TRUE(exported.step(20));
  ASSERT_EQ(other.simulation().restore_state(state), "");
  ASSERT_TRUE(other.step(20));
  EXPECT_EQ(other.value("state_hash_1"), exported.value("state_hash_1"));
  EXPECT_EQ(other.simulation().state_hash(), exported.simulation().state_hash());
  // A reset returns to the start.
  exported.simulation().reset();
  EXPECT_EQ(exported.value("Robot1_q_1"), start);
}

TEST(FmuExport, PatternsWithoutAVariableAndCellsWithFmusAreRefused) {
  const test::TemporaryDirectory directory;
  FmuExportOptions options = options_for(directory / "block.fmu", 2);
  options.outputs = {"Robot7.q[*]"};
  EXPECT_THAT([&] { export_fmu(read_scenario(kScenarios + "block_assembly.yaml"), options); },
              testing::ThrowsMessage<ScenarioError>(HasSubstr(
                  "--outputs: found 'Robot7.q[*]', which fits no output of the cell; allowed: Robot1.q[1]")));
  directory.write("cell.yaml", "takt_scenario: 1\nname: fmu\nfmus: {Motor: {file: " +
                                   (test::kTestFmus / "motor2.fmu").string() + "}}\n");
  EXPECT_THAT(
      [&] { export_fmu(read_scenario(directory / "cell.yaml"), options); },
      testing::ThrowsMessage<ScenarioError>(HasSubstr("fmus.Motor: found an FMU in a cell to export")));
}

TEST(FmuExport, AStepThatIsNoMultipleOfTheCellsIsDiscarded) {
  const test::TemporaryDirectory directory;
  directory.write("cell.yaml", "takt_scenario: 1\nname: empty\nsolver: {step_s: 0.01}\n");
  export_fmu(read_scenario(directory / "cell.yaml"), options_for(directory / "empty.fmu", 2));
  FmuCell cell(directory / "empty.fmu", "memory_MiB: 4096", 0.015);
  ASSERT_TRUE(cell.step());
  EXPECT_THAT(
      cell.notices(),
      HasSubstr("the communication step is 0.015 s; allowed is a whole multiple of the cell's step, 0.01 s"));
}

}  // namespace
}  // namespace takt
