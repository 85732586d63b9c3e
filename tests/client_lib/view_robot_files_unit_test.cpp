#include "client_lib/view/robot_files.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_directory.h"

namespace takt::view {
namespace {

namespace fs = std::filesystem;

TEST(RobotFiles, OnlyDrawableFilesBelowTheFolderAreServed) {
  const test::TemporaryDirectory directory;
  const fs::path root = fs::canonical(directory / ".");
  for (const char* folder : {"robots/meshes", "robots/urdf", "secret", "robots2"})
    fs::create_directories(root / folder);
  for (const char* file : {"robots/meshes/link.STL", "robots/meshes/two words.obj", "robots/robot.dae",
                           "robots/notes.txt", "secret/key.stl", "robots2/other.stl"})
    std::ofstream(root / file) << "x";
  fs::create_symlink(root / "secret/key.stl", root / "robots/meshes/out.stl");
  fs::create_symlink(root / "robots/robot.dae", root / "robots/meshes/in.dae");
  const RobotFiles files({root / "robots" / "urdf", root / "robots"});
  EXPECT_TRUE(files.any());
  const auto expect = [&](std::string_view address, const char* file) {
    const auto found = files.find(address);
    ASSERT_TRUE(found.has_value()) << address;
    EXPECT_EQ(*found, root / file) << address;
  };
  expect("relative/meshes/link.STL", "robots/meshes/link.STL");
  expect("relative/meshes/two%20words.obj", "robots/meshes/two words.obj");
  expect("relative/(up)/meshes/link.STL", "robots/meshes/link.STL");  // seen from urdf/
  expect("package/robots/meshes/link.STL", "robots/meshes/link.STL");
  expect("package/meshes/link.STL", "robots/meshes/link.STL");  // a package below the folder
  expect("relative/meshes/in.dae", "robots/robot.dae");
  expect("absolute" + (root / "robots/robot.dae").string(), "robots/robot.dae");
  const std::string outside = "absolute" + (root / "secret/key.stl").string();
  for (const std::string& address :
       {std::string("relative/meshes/none.stl"), std::string("relative/notes.txt"),
        std::string("relative/meshes/out.stl"), std::string("relative/(up)/secret/key.stl"),
        std::string("relative/(up)/robots2/other.stl"), std::string("relative/%2e%2e/secret/key.stl"),
        std::string("relative/%2Fetc%2Fpasswd"), std::string("package/secret/key.stl"), outside,
        std::string("relative/meshes"), std::string("relative"), std::string(""), std::string("other/x.stl"),
        std::string("relative/meshes/link%00.STL"), std::string("relative/meshes/link%2.STL"),
        std::string("relative/%")})
    EXPECT_FALSE(files.find(address).has_value()) << address;
  EXPECT_FALSE(RobotFiles().find("relative/meshes/link.STL").has_value());
  EXPECT_FALSE(RobotFiles().any());
}

}  // namespace
}  // namespace takt::view
