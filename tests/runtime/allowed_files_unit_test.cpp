// Files that clients may name, with and without a directory for them.
#include "server/runtime/host/allowed_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

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
  action = load("cell.yaml", {R"(parts.C.mesh="\x2fetc\x2fpasswd")"});
  EXPECT_THAT(confine(action, files.path()), HasSubstr("names a file in another directory"));
  action = load("cell.yaml", {R"(parts.C={mesh: "\u002e.\u002fC.obj"})"});
  EXPECT_THAT(confine(action, files.path()), HasSubstr("names a file in another directory"));
  action = load("cell.yaml", {"parts.C.mesh=[unfinished"});
  EXPECT_EQ(confine(action, files.path()), "");  // no file is read: the value is refused when it is applied
  action = load("cell.yaml", {"solver.step_s=0.002"});
  EXPECT_EQ(confine(action, files.path()), "");
  action = requests::UnloadScenario{};
  EXPECT_EQ(confine(action, files.path()), "");
}

TEST(AllowedFiles, OverridesFollowNoLinksOutOfTheDirectory) {
  const test::TemporaryDirectory files, others;
  others.write("secret.obj", "x");
  files.write("C.obj", "x");
  std::filesystem::create_symlink(others / "secret.obj", files / "link.obj");
  std::filesystem::create_symlink(files / "C.obj", files / "inside.obj");
  requests::Any action = load("cell.yaml", {"parts.C.mesh=link.obj"});
  EXPECT_THAT(confine(action, files.path()), HasSubstr("names a file in another directory"));
  action = load("cell.yaml", {"parts={C: {mesh: link.obj}}"});
  EXPECT_THAT(confine(action, files.path()), HasSubstr("names a file in another directory"));
  // The node of a mesh hides no link.
  action = load("cell.yaml", {"parts.C.mesh=link.obj#Bolt"});
  EXPECT_THAT(confine(action, files.path()), HasSubstr("names a file in another directory"));
  action = spawn("link.obj#Bolt");
  EXPECT_THAT(confine(action, files.path()), HasSubstr("is not below"));
  action = spawn("inside.obj#Frame/Bolt");
  EXPECT_EQ(confine(action, files.path()), "");
  EXPECT_EQ(std::get<requests::SpawnEntity>(action).uri,
            std::filesystem::canonical(files / "C.obj").string() + "#Frame/Bolt");
  for (const char* name : {"inside.obj", "C.obj", "none.obj", "C.obj#Bolt"}) {
    action = load("cell.yaml", {"parts.C.mesh=" + std::string(name)});
    EXPECT_EQ(confine(action, files.path()), "") << name;
  }
}

TEST(AllowedFiles, AliasesOfAliasesInAnOverrideAreRefused) {
  const test::TemporaryDirectory files;
  std::string laughs = "x={a0: &a0 [x, x]";
  for (int i = 1; i < 60; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    laughs += ", a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + last + ", " + last + "]";
  }
  requests::Any action = load("cell.yaml", {laughs + "}"});
  EXPECT_NE(confine(action, files.path()), "");
}

TEST(AllowedFiles, PipesAndDevicesAreRefused) {
  const test::TemporaryDirectory files;
  ASSERT_EQ(::mkfifo((files / "pipe.yaml").c_str(), 0600), 0);
  for (const std::filesystem::path& directory : {files.path(), std::filesystem::path()}) {
    requests::Any action = load(files / "pipe.yaml");
    EXPECT_THAT(confine(action, directory), HasSubstr("is no regular file"));
    action = spawn(files / "pipe.yaml");
    EXPECT_THAT(confine(action, directory), HasSubstr("is no regular file"));
  }
  requests::Any action = load("/dev/zero");
  EXPECT_THAT(confine(action, ""), HasSubstr("is no regular file"));
}

}  // namespace
}  // namespace takt
