// Files that clients may name, with and without a directory for them.
#include "server/runtime/host/allowed_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

requests::Any load(const std::filesystem::path& file, std::vector<std::string> overrides = {}) {
  return requests::LoadScenario{file.string(), std::move(overrides), {}};
}
requests::Any spawn(const std::filesystem::path& mesh) {
  return requests::SpawnEntity{.name = "X", .uri = mesh.string()};
}

TEST(AllowedFiles, EveryFileIsAllowedWithoutADirectory) {
  requests::Any action = load("/etc/passwd");
  EXPECT_EQ(confine(action, ""), "");
  EXPECT_EQ(std::get<requests::LoadScenario>(action).uri, "/etc/passwd");
}

TEST(AllowedFiles, NamesAreRelativeToTheDirectoryAndStayBelowIt) {
  const test::TemporaryDirectory files, others;
  files.write("cell.yaml", "x");
  others.write("secret.yaml", "x");
  std::filesystem::create_directory(files / "sub");
  std::filesystem::create_symlink(others / "secret.yaml", files / "link.yaml");
  const auto root = std::filesystem::canonical(files.path());
  for (const auto& [name, becomes] :
       {std::pair<std::filesystem::path, std::filesystem::path>{"cell.yaml", root / "cell.yaml"},
        {"sub/../cell.yaml", root / "cell.yaml"},
        {files / "cell.yaml", root / "cell.yaml"},
        {"sub/not_yet.yaml", root / "sub/not_yet.yaml"}}) {
    requests::Any action = load(name);
    EXPECT_EQ(confine(action, files.path()), "") << name;
    EXPECT_EQ(std::get<requests::LoadScenario>(action).uri, becomes.string());
    action = spawn(name);
    EXPECT_EQ(confine(action, files.path()), "") << name;
  }
  for (const std::filesystem::path& name :
       {std::filesystem::path("../x.yaml"), others / "secret.yaml", std::filesystem::path("link.yaml"),
        std::filesystem::path("sub/../../x"), std::filesystem::path(files.path().string() + "_beside/x")}) {
    requests::Any action = load(name);
    EXPECT_THAT(confine(action, files.path()), HasSubstr("is not below the directory of scenarios")) << name;
    action = spawn(name);
    EXPECT_THAT(confine(action, files.path()), HasSubstr("is not below")) << name;
  }
}

TEST(AllowedFiles, AUriIsAFileOrItsName) {
  EXPECT_EQ(file_of_uri("file:///a/b.yaml"), "/a/b.yaml");
  EXPECT_EQ(file_of_uri("cell.yaml"), "cell.yaml");
}

TEST(AllowedFiles, OverridesNameNoFilesElsewhere) {
  const test::TemporaryDirectory files;
  requests::Any action = load("cell.yaml", {"parts.C.mesh=/etc/passwd"});
  EXPECT_THAT(confine(action, files.path()), HasSubstr("parts.C.mesh=/etc/passwd"));
  action = load("cell.yaml", {"parts.C.mesh=../C.obj"});
  EXPECT_NE(confine(action, files.path()), "");
  action = load("cell.yaml", {"solver.step_s=0.002"});
  EXPECT_EQ(confine(action, files.path()), "");
  action = requests::UnloadScenario{};
  EXPECT_EQ(confine(action, files.path()), "");
}

}  // namespace
}  // namespace takt
