// The committed schema and references agree with the tables of the code; devices have the signals of their kind's table;
// and every shipped scenario that is read and written back is the same model.
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "server/devices/device_type.h"
#include "server/fields/expected_poses.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/reference_pages.h"
#include "server/headless/scenario_schema.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_writer.h"
#include "server/simulation/model/model_hash.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ScenarioSchema, IsTheCommittedOne) {
  EXPECT_TRUE(text_of(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "scenario.schema.json") ==
              scenario_schema())
      << "takt-run schema > config/scenarios/scenario.schema.json";
}

TEST(ScenarioSchema, IsTheReferencePage) {
  EXPECT_TRUE(text_of(std::filesystem::path(TAKT_SOURCE_DIR) / "docs" / "scenario_reference.md") ==
              scenario_reference())
      << "takt-run reference > docs/scenario_reference.md";
}

TEST(ReferencePages, AreTheCommittedOnes) {
  const std::filesystem::path docs = std::filesystem::path(TAKT_SOURCE_DIR) / "docs";
  EXPECT_TRUE(text_of(docs / "signals.md") == signals_reference())
      << "takt-run reference signals > docs/signals.md";
  EXPECT_TRUE(text_of(docs / "lua.md") == lua_reference()) << "takt-run reference lua > docs/lua.md";
}

/// "N m s/rad, motor side" as the end of a key: "N_m_s_per_rad".
std::string key_end(std::string unit) {
  unit = unit.substr(0, unit.find(','));
  if (unit.starts_with("1/")) unit.erase(0, 1);
  std::string end;
  for (const char c : unit)
    if (c == '/')
      end += end.empty() ? "per_" : "_per_";
    else if (c == ' ')
      end += '_';
    else if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      end += c;
  return end;
}

/// Keys of corners of a box, whose unit is that of the coordinates.
bool is_corner(const std::string& key) {
  return key == "lower" || key == "upper";
}

void expect_keys_in_units(const KeyInfo& info, const std::string& key, int& found) {
  if (!info.unit.empty() && !is_corner(key)) {
    ++found;
    EXPECT_TRUE(key.ends_with("_" + key_end(info.unit))) << key << " in " << info.unit;
  }
  for (const KeyInfo& item : info.items) expect_keys_in_units(item, item.key.empty() ? key : item.key, found);
  for (const KeyInfo& form : info.other_forms) expect_keys_in_units(form, key, found);
}

TEST(ScenarioKeys, EndInTheirUnit) {
  int found = 0;
  expect_keys_in_units(scenario_info(), "", found);
  EXPECT_GT(found, 100);
}

class WrittenScenario : public testing::TestWithParam<std::filesystem::path> {};

TEST_P(WrittenScenario, IsTheSameModelAtEveryLevel) {
  const test::TemporaryDirectory directory;
  const ImportOptions import{user_cache_directory()};
  const Scenario scenario = read_scenario(GetParam());
  const std::string text = write_scenario(scenario, directory.path());
  directory.write("written.yaml", text);
  const Scenario again = read_scenario(directory.path() / "written.yaml");
  EXPECT_EQ(write_scenario(again, directory.path()), text);
  EXPECT_EQ(model_hash(*build_cell(scenario, import)), model_hash(*build_cell(again, import))) << text;
  for (const int level : {1, 3}) {
    ScenarioOptions options;
    options.level_of_detail = level;
    const Scenario one = read_scenario(GetParam(), options),
                   other = read_scenario(directory.path() / "written.yaml", options);
    EXPECT_EQ(one.step_s, other.step_s);
    EXPECT_EQ(one.initial_solver(), other.initial_solver());
    EXPECT_EQ(one.initial_tolerance(), other.initial_tolerance());
  }
}

std::vector<std::filesystem::path> shipped() {
  std::vector<std::filesystem::path> files;
  for (const char* folder : {"scenarios", "devices"})
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(std::filesystem::path(TAKT_CONFIG_DIR) / folder))
      if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  return files;
}

INSTANTIATE_TEST_SUITE_P(Shipped, WrittenScenario, testing::ValuesIn(shipped()),
                         [](const auto& file) { return file.param.stem().string(); });

TEST(SignalsOfDevices, AreThoseOfTheReference) {
  std::set<std::string> seen;
  for (const std::filesystem::path& file : shipped()) {
    const auto cell = build_cell(read_scenario(file), ImportOptions{user_cache_directory()});
    for (const DeviceDescription& device : cell->description.devices) {
      const DeviceType& type = device_type(device.type);
      if (*type.further_signals != '\0') continue;
      SCOPED_TRACE(file.filename().string() + ": " + device.name);
      seen.insert(device.type);
      ASSERT_EQ(device.signals.size(), type.signals.size());
      for (std::size_t i = 0; i < device.signals.size(); ++i) {
        EXPECT_EQ(device.signals[i].name, type.signals[i].name);
        EXPECT_EQ(device.signals[i].commanded, type.signals[i].commanded);
        EXPECT_EQ(device.signals[i].type, type.signals[i].type);
        EXPECT_EQ(device.signals[i].unit, type.signals[i].unit);
      }
    }
  }
  for (const DeviceType& type : device_types()) {
    if (*type.further_signals != '\0') continue;
    EXPECT_TRUE(seen.contains(type.key)) << "no shipped scenario has " << type.key;
  }
}

// What `takt check` compares with is read alone, by the same tables.
TEST(ScenarioWriter, ExpectedPosesOfAWrittenFileAreReadAlone) {
  ScenarioOptions options;
  options.overrides = {
      "expected.parts.P={position_m: [1, 2, 3], quaternion_xyzw: [0.1, 0.2, 0.3, 0.9273618495495703]}"};
  const Scenario scenario = read_scenario(TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml", options);
  const test::TemporaryDirectory directory;
  const std::string text = write_scenario(scenario, directory.path());
  EXPECT_NE(text.find("rotation_matrix"), std::string::npos);
  const std::filesystem::path file = directory.path() / "written.yaml";
  std::ofstream(file) << text;
  const ExpectedPoses expected = read_expected(file);
  EXPECT_EQ(expected.tolerance_m, scenario.expected_tolerance_m);
  ASSERT_EQ(expected.parts.size(), scenario.expected.size());
  for (std::size_t i = 0; i < expected.parts.size(); ++i) {
    EXPECT_EQ(expected.parts[i].part, scenario.expected[i].part);
    EXPECT_EQ(expected.parts[i].X_WB.p, scenario.expected[i].X_WB.p);
    EXPECT_EQ(expected.parts[i].X_WB.R, scenario.expected[i].X_WB.R);
  }
  std::ofstream(file) << "takt_scenario: 1\nexpected: {parts: {P: {position_m: [0, 0]}}}\n";
  try {
    read_expected(file);
    ADD_FAILURE() << "a position of two numbers";
  } catch (const ScenarioError& error) {
    const std::string sentence = error.what();
    EXPECT_NE(sentence.find("written.yaml:2:"), std::string::npos) << sentence;
    EXPECT_NE(sentence.find("expected.parts.P.position_m: found "), std::string::npos) << sentence;
  }
  std::ofstream(file) << "takt_scenario: 1\n";
  EXPECT_THROW(read_expected(file), ScenarioError);
}

}  // namespace
}  // namespace takt
