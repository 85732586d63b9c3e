// The library of devices, and the line made of them: every scenario meets its assertions, and gives the same bits twice.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "server/headless/device_report.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

std::vector<std::filesystem::path> library() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(TAKT_CONFIG_DIR) / "devices"))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  files.push_back(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "line.yaml");
  return files;
}

class DeviceLibrary : public ::testing::TestWithParam<std::filesystem::path> {};

TEST_P(DeviceLibrary, MeetsItsAssertions) {
  const Scenario scenario = read_scenario(GetParam());
  const auto cell = build_cell(scenario);
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  options.program = scenario.controller_program;
  std::set<std::uint64_t> hashes;
  for (int run = 0; run < 2; ++run) {
    Simulation simulation(cell);
    const HeadlessResult result = run_headless(simulation, scenario, options);
    EXPECT_EQ(result.fault, "");
    for (const AssertionResult& assertion : result.assertions)
      EXPECT_EQ(assertion.verdict, AssertionResult::Verdict::passed)
          << assertion.name << ": " << assertion.sentence;
    hashes.insert(result.final_state.state_hash);
  }
  EXPECT_EQ(hashes.size(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, DeviceLibrary, ::testing::ValuesIn(library()),
                         [](const auto& one) { return one.param.stem().string(); });

TEST(Line, NoPartIsLostInAHundred) {
  const Scenario scenario = read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "line.yaml");
  Simulation simulation(build_cell(scenario));
  HeadlessOptions options;
  options.duration_s = 610.0;
  options.program = scenario.controller_program;
  const HeadlessResult result = run_headless(simulation, scenario, options);
  ASSERT_EQ(result.fault, "");
  const CellDescription& cell = simulation.description();
  const auto count = [&](const char* device, const char* signal) {
    return std::lround(signal_value(cell, result.final_state, device, signal).value());
  };
  long inside = 0;
  for (std::size_t c = 0; c < cell.components.size(); ++c)
    if (cell.components[c].type == ComponentType::part &&
        result.final_state.components[c].state != PartState::parked)
      ++inside;
  EXPECT_EQ(count("Feeder", "released"), 102) << "one each 6 s, the first at once";
  EXPECT_GE(count("Outlet", "removed"), 99);
  EXPECT_EQ(count("Feeder", "released"), count("Outlet", "removed") + inside);
}

}  // namespace
}  // namespace takt
