#include "client_lib/view/robot_files.h"

#include <gtest/gtest.h>

#include <fstream>

#include "idl/common/ros_packages.h"
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

TEST(RobotFiles, PackagesAreFoundAsRobotDescriptionsFindThem) {
  const test::TemporaryDirectory directory;
  const fs::path root = fs::canonical(directory / ".");
  for (const char* folder : {"src/Arm_ROS2/meshes", "src/vendor/hand/meshes", "opt/share/base/meshes"}) {
    fs::create_directories(root / folder);
    std::ofstream(root / folder / "link.stl") << "x";
  }
  std::ofstream(root / "src/Arm_ROS2/package.xml") << "<package><name>arm_description</name></package>";
  std::ofstream(root / "src/vendor/hand/package.xml") << "<package><name>hand_description</name></package>";
  const std::vector<fs::path> folders{root / "src", root / "opt"};
  const RobotFiles files(folders);
  for (const auto& [package, place] :
       {std::pair{"arm_description", "src/Arm_ROS2"}, std::pair{"hand_description", "src/vendor/hand"},
        std::pair{"base", "opt/share/base"}}) {
    const fs::path expected = root / place / "meshes/link.stl";
    const std::string path = std::string(package) + "/meshes/link.stl";
    EXPECT_EQ(files.find("package/" + path), expected);
    EXPECT_EQ(find_mesh_file("package://" + path, root / "robot.urdf", folders), expected);
    // xacro writes the places of the machine that it ran on.
    EXPECT_EQ(files.find("absolute/elsewhere/share/" + path), expected);
  }
  EXPECT_FALSE(files.find("package/arm/meshes/link.stl").has_value());
  EXPECT_FALSE(files.find("package/arm_description/(up)/(up)/secret.stl").has_value());
}

}  // namespace
}  // namespace takt::view
