// What get_scenarios and get_spawnables list: files below a directory, without what must not or cannot be read.
#include "server/runtime/host/file_lists.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> names(const Outcome<requests::GetScenarios>& listed) {
  std::vector<std::string> result;
  for (const auto& scenario : listed.response.scenarios) result.push_back(scenario.scenario);
  return result;
}

class FileLists : public ::testing::Test {
 protected:
  FileLists() {
    std::filesystem::create_directories(cells / "line/deep");
    cells.write("a.yaml",
                "takt_scenario: 1\nname: first\ndescription: the first\ntags: [one, two]\nparts: {}\n");
    cells.write("line/deep/b.YML", "takt_scenario: 1\nname: second\nno_such_key: 1\n");
    cells.write("line/mapping.yaml", "robot: R\n");
    cells.write("line/broken.yaml", "takt_scenario: 1\nname: [\n");
    cells.write("c.txt", "takt_scenario: 1\nname: text\n");
    cells.write("bolt.obj", "v 0 0 0\n");
    cells.write("line/Nut.STL", "solid\n");
    others.write("secret.yaml", "takt_scenario: 1\nname: secret\n");
    std::filesystem::create_symlink(others / "secret.yaml", cells / "link.yaml");
    std::filesystem::create_symlink(others.path(), cells / "link");
  }
  const test::TemporaryDirectory cells, others;
};

TEST_F(FileLists, ScenariosAreThoseBelowTheDirectory) {
  const auto listed = list_scenarios({}, cells.path(), {});
  ASSERT_TRUE(listed.ok()) << listed.message;
  ASSERT_THAT(names(listed), ElementsAre("first", "second"));
  const auto& first = listed.response.scenarios[0];
  EXPECT_EQ(first.uri, (std::filesystem::canonical(cells.path()) / "a.yaml").string());
  EXPECT_EQ(first.description, "the first");
  EXPECT_THAT(first.tags, ElementsAre("one", "two"));
  EXPECT_THAT(listed.message, HasSubstr("2 scenarios. 1 file cannot be read, first"));
  EXPECT_THAT(listed.message, HasSubstr("broken.yaml:3:1"));
  // A relative name of the directory, as on a command line.
  EXPECT_THAT(names(list_scenarios({}, std::filesystem::relative(cells.path()), {})),
              ElementsAre("first", "second"));
}

TEST_F(FileLists, WithoutADirectoryTheFilesBesideTheLoadedOneAreListed) {
  EXPECT_THAT(names(list_scenarios({}, {}, cells / "a.yaml")), ElementsAre("first"));
  EXPECT_TRUE(list_scenarios({}, {}, {}).ok());
  EXPECT_THAT(names(list_scenarios({}, {}, {})), ElementsAre());
}

TEST_F(FileLists, SourcesAddDirectoriesAndFiles) {
  const std::string deep = (cells / "line/deep").string(), file = (others / "secret.yaml").string();
  EXPECT_THAT(names(list_scenarios({{deep, "file://" + file}, false}, {}, {})),
              ::testing::UnorderedElementsAre("second", "secret"));
  const auto outside = list_scenarios({{file}, false}, cells.path(), {});
  EXPECT_EQ(outside.result, ControlResult::not_found);
  EXPECT_THAT(outside.message, HasSubstr("is not below the directory of scenarios"));
}

TEST_F(FileLists, AMissingSourceFailsUnlessTheRestIsWanted) {
  const auto missing = list_scenarios({{"nowhere"}, false}, cells.path(), {});
  EXPECT_EQ(missing.result, ControlResult::not_found);
  EXPECT_THAT(missing.message,
              HasSubstr("'nowhere' is neither a directory nor a file of the kind yaml, yml"));
  const auto rest = list_scenarios({{"nowhere"}, true}, cells.path(), {});
  EXPECT_THAT(names(rest), ElementsAre("first", "second"));
  EXPECT_THAT(rest.message, HasSubstr("'nowhere' is neither"));
  EXPECT_EQ(list_scenarios({{"nowhere"}, true}, {}, {}).result, ControlResult::not_found);
  EXPECT_EQ(list_scenarios({}, cells / "gone", {}).result, ControlResult::default_sources_failed);
}

TEST_F(FileLists, SpawnablesArePartsAndMeshFilesOfTheSources) {
  Scenario content;
  content.parts.resize(1);
  content.parts[0].name = "P";
  content.parts[0].mass_kg = 0.25;
  content.parts[0].hierarchy = 2;
  CellDescription cell;
  auto mesh = std::make_shared<DescribedMesh>();
  mesh->vertices = {0, 0, 0, 1, -2, 3, 0.5, 1, -1};
  ComponentDescription component;
  component.name = "P";
  component.mesh = mesh;
  cell.components.push_back(component);
  const auto listed = list_spawnables({{cells.path().string(), "ftp://else"}}, cells.path(), &content, cell);
  ASSERT_TRUE(listed.ok());
  ASSERT_EQ(listed.response.spawnables.size(), 3U);
  const auto& part = listed.response.spawnables[0];
  EXPECT_EQ(part.copy_of, "P");
  EXPECT_EQ(part.description, "another P, 0.25 kg, hierarchy 2");
  EXPECT_EQ(*part.lower, (takt_msgs::msg::Vector3{0, -2, -1}));
  EXPECT_EQ(*part.upper, (takt_msgs::msg::Vector3{1, 1, 3}));
  const auto root = std::filesystem::canonical(cells.path());
  EXPECT_EQ(listed.response.spawnables[1].uri, (root / "bolt.obj").string());
  EXPECT_EQ(listed.response.spawnables[2].uri, (root / "line/Nut.STL").string());
  EXPECT_THAT(listed.message, HasSubstr("'ftp://else'"));
  EXPECT_TRUE(list_spawnables({}, {}, nullptr, cell).response.spawnables.empty());
}

}  // namespace
}  // namespace takt
