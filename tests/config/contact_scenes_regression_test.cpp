// Every scene of the contact library is documented, loads, and states the final places of its parts.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> scenes() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(TAKT_CONFIG_DIR) / "scenarios" / "contact"))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

TEST(ContactScenes, EverySceneIsListedInTheDocumentation) {
  std::ifstream stream(fs::path(TAKT_SOURCE_DIR) / "docs" / "scenes.md");
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const auto files = scenes();
  EXPECT_GE(files.size(), 11U);
  for (const fs::path& file : files)
    EXPECT_NE(text.find("`" + file.stem().string() + "`"), std::string::npos) << file;
}

TEST(ContactScenes, EverySceneLoads) {
  if constexpr (kMaxLevelOfDetail < 3) GTEST_SKIP() << "they need level of detail 3";
  for (const fs::path& file : scenes()) {
    SCOPED_TRACE(file);
    const Scenario scenario = read_scenario(file);
    EXPECT_EQ(scenario.name, file.stem().string());
    EXPECT_NE(scenario.description, "");
    EXPECT_GT(scenario.duration_s, 0.0);
    EXPECT_FALSE(scenario.expected.empty());
    ASSERT_EQ(scenario.processes.size(), 1U);
    EXPECT_EQ(scenario.processes[0].level_of_detail, 3);
    const auto cell = build_cell(scenario);
    EXPECT_EQ(cell->parts.size(), scenario.parts.size());
    EXPECT_EQ(cell->grounds.size(), scenario.grounds.size());
  }
}

}  // namespace
}  // namespace takt
