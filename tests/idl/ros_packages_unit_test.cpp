// Where meshes that robot descriptions name by package are found.
#include "idl/common/ros_packages.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

class RosPackages : public testing::Test {
 protected:
  std::filesystem::path make(const std::string& file) {
    std::filesystem::create_directories((directory_ / file).parent_path());
    directory_.write(file, "solid\n");
    return directory_ / file;
  }
  std::string found(const std::string& name, const PackageFolders& folders,
                    const std::string& description = "elsewhere/robot.urdf") const {
    const auto file = find_mesh_file(name, directory_ / description, folders);
    return file ? std::filesystem::weakly_canonical(*file).lexically_relative(
                      std::filesystem::weakly_canonical(directory_ / "."))
                : "nothing";
  }
  test::TemporaryDirectory directory_;
};

TEST_F(RosPackages, AreSearchedInEachKindOfFolder) {
  make("ws/src/arm/meshes/link.stl");
  make("opt/ros/share/hand/meshes/palm.stl");
  const std::string link = "package://arm/meshes/link.stl", palm = "package://hand/meshes/palm.stl";
  EXPECT_EQ(found(link, {directory_ / "ws/src"}), "ws/src/arm/meshes/link.stl");
  EXPECT_EQ(found(link, {directory_ / "ws/src/arm"}), "ws/src/arm/meshes/link.stl");
  EXPECT_EQ(found(link, {directory_ / "ws/src/arm/"}), "ws/src/arm/meshes/link.stl");
  EXPECT_EQ(found(palm, {directory_ / "ws/src", directory_ / "opt/ros"}),
            "opt/ros/share/hand/meshes/palm.stl");
  EXPECT_EQ(found("model://arm/meshes/link.stl", {directory_ / "ws/src"}), "ws/src/arm/meshes/link.stl");
  EXPECT_EQ(found(link, {directory_ / "opt/ros"}), "nothing");
  EXPECT_EQ(found("package://arm/meshes/other.stl", {directory_ / "ws/src"}), "nothing");
  EXPECT_EQ(found("package://", {directory_ / "ws/src"}), "nothing");
  EXPECT_EQ(found("package://arm", {directory_ / "ws/src"}), "nothing");
}

TEST_F(RosPackages, TheFirstFolderCountsAndThenThoseAboveTheDescription) {
  make("a/arm/m.stl");
  make("b/arm/m.stl");
  make("src/arm/m.stl");
  make("src/hand/m.stl");
  const std::string name = "package://arm/m.stl";
  EXPECT_EQ(found(name, {directory_ / "b", directory_ / "a"}), "b/arm/m.stl");
  EXPECT_EQ(found(name, {}, "src/arm/urdf/robot.urdf"), "src/arm/m.stl");
  EXPECT_EQ(found("package://hand/m.stl", {}, "src/arm/urdf/robot.urdf"), "src/hand/m.stl");
  EXPECT_EQ(found(name, {directory_ / "a"}, "src/arm/urdf/robot.urdf"), "a/arm/m.stl");
  EXPECT_EQ(found(name, {}), "nothing");
}

TEST_F(RosPackages, AreCalledAsTheirManifestStates) {
  const auto package = [&](const std::string& folder, const std::string& name) {
    make(folder + "/meshes/link.stl");
    directory_.write(folder + "/package.xml", "<?xml version=\"1.0\"?>\n<package format=\"3\">\n  <name> " +
                                                  name + "\n</name>\n</package>\n");
  };
  package("src/Arm_ROS2_Description", "arm_description");  // a repository that is one package
  package("src/vendor/hand_files", "hand_description");    // a repository of packages
  package("src/arm_description_old", "other");
  make("src/none/package.xml");  // no manifest
  const std::string arm = "package://arm_description/meshes/link.stl",
                    hand = "package://hand_description/meshes/link.stl";
  EXPECT_EQ(found(arm, {directory_ / "src"}), "src/Arm_ROS2_Description/meshes/link.stl");
  EXPECT_EQ(found(arm, {directory_ / "src/Arm_ROS2_Description"}),
            "src/Arm_ROS2_Description/meshes/link.stl");
  EXPECT_EQ(found(hand, {directory_ / "src"}), "src/vendor/hand_files/meshes/link.stl");
  EXPECT_EQ(found(arm, {}, "src/Arm_ROS2_Description/urdf/arm.urdf"),
            "src/Arm_ROS2_Description/meshes/link.stl");
  EXPECT_EQ(found("package://other/meshes/link.stl", {}, "src/Arm_ROS2_Description/urdf/arm.urdf"),
            "src/arm_description_old/meshes/link.stl");
  EXPECT_EQ(found("package://none_description/meshes/link.stl", {directory_ / "src"}), "nothing");
  // A folder of that name comes first.
  make("src/arm_description/meshes/link.stl");
  EXPECT_EQ(found(arm, {directory_ / "src"}), "src/arm_description/meshes/link.stl");
}

TEST_F(RosPackages, OtherNamesAreFiles) {
  const auto file = make("robots/meshes/link.stl");
  EXPECT_EQ(found("meshes/link.stl", {}, "robots/robot.urdf"), "robots/meshes/link.stl");
  EXPECT_EQ(found("file://" + file.string(), {}), "robots/meshes/link.stl");
  EXPECT_EQ(found(file.string(), {}), "robots/meshes/link.stl");
  // A place on another machine names a package that is here.
  make("packages/arm/meshes/hand.stl");
  const std::string elsewhere = "file:///opt/ws/install/arm/share/arm/meshes/hand.stl";
  EXPECT_EQ(found(elsewhere, {directory_ / "packages"}), "packages/arm/meshes/hand.stl");
  EXPECT_EQ(found(elsewhere, {}), "nothing");
  // Blanks are escaped in addresses; a file that is called so as it stands comes first.
  make("packages/my arm/a b.stl");
  for (const char* name : {"package://my%20arm/a%20b.stl", "package://my arm/a b.stl"})
    EXPECT_EQ(found(name, {directory_ / "packages"}), "packages/my arm/a b.stl") << name;
  EXPECT_EQ(found("../packages/my%20arm/a%20b.stl", {}, "robots/robot.urdf"), "packages/my arm/a b.stl");
  make("robots/a%20b.stl");
  EXPECT_EQ(found("a%20b.stl", {}, "robots/robot.urdf"), "robots/a%20b.stl");
  EXPECT_EQ(package_of("package://arm/m.stl"), "arm");
  EXPECT_EQ(package_of("meshes/package.stl"), "");
}

}  // namespace
}  // namespace takt
