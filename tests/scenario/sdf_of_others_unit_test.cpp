// What files of SDFormat that others wrote have in another way than the specification's examples, against its text.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "server/geometry/mesh/obj_writer.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_writer.h"
#include "server/scenario/sdf_cell.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

class SdfOfOthers : public testing::Test {
 protected:
  SdfWorld read(const std::string& inside, const std::string& file = "world.sdf") {
    write(file, "<sdf version='1.9'>\n" + inside + "\n</sdf>\n");
    return read_sdf(directory_ / file, options_);
  }
  void write(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((directory_ / file).parent_path());
    directory_.write(file, text);
  }
  static std::string box(const std::string& name, const std::string& size, const std::string& pose = "") {
    return "<link name='" + name + "'>" + (pose.empty() ? "" : "<pose>" + pose + "</pose>") +
           "<inertial><mass>1</mass></inertial><collision name='c'><geometry><box><size>" + size +
           "</size></box></geometry></collision></link>";
  }
  static std::string mesh(const std::string& uri) {
    return "<model name='m'><link name='l'><collision name='c'><geometry><mesh><uri>" + uri +
           "</uri></mesh></geometry></collision></link></model>";
  }
  std::string file_of(const SdfWorld& world) const {
    return std::filesystem::path(world.models.at(0).links.at(0).collisions.at(0).filename)
        .lexically_relative(std::filesystem::absolute(directory_ / "."))
        .lexically_normal()
        .string();
  }
  test::TemporaryDirectory directory_;
  SdfOptions options_;
};

TEST_F(SdfOfOthers, NumbersThatAShapeLacksAreThoseOfTheSpecification) {
  const SdfWorld world = read(
      "<model name='m'><link name='l'>"
      "<collision name='a'><geometry><sphere>3</sphere></geometry></collision>"
      "<collision name='b'><geometry><box/></geometry></collision>\n"
      "<collision name='c'><geometry><cylinder><radius>0.2</radius></cylinder></geometry></collision>"
      "<visual name='v'/><visual name='w'><geometry/></visual></link>"
      "<link name='k'/><joint name='j' type='revolute'><parent>l</parent><child>k</child></joint></model>");
  const SdfLink& link = world.models.at(0).links.at(0);
  ASSERT_EQ(link.collisions.size(), 3U);
  EXPECT_EQ(link.collisions[0].radius_m, 1.0);
  EXPECT_EQ(link.collisions[1].size_m, Vec3(1, 1, 1));
  EXPECT_EQ(link.collisions[2].radius_m, 0.2);
  EXPECT_EQ(link.collisions[2].length_m, 1.0);
  EXPECT_THAT(link.visuals, IsEmpty());
  const SdfJoint& joint = world.models[0].joints.at(0);
  EXPECT_EQ(joint.axis, Vec3(0, 0, 1));
  EXPECT_TRUE(std::isinf(joint.upper));
  EXPECT_THAT(world.notes,
              AllOf(Contains(HasSubstr("line 2: link 'l': <collision>: <sphere>: found no <radius>; 1 m")),
                    Contains(HasSubstr("line 3: link 'l': <collision>: <cylinder>: found no <length>")),
                    Contains(HasSubstr("link 'l': <visual>: it is left out")),
                    Contains(HasSubstr("joint 'j': found no <axis>; z is taken"))));
}

TEST_F(SdfOfOthers, AMassOfZeroStands) {
  const std::string massless = "<inertial><mass>0</mass></inertial>";
  const std::string shape =
      "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>";
  const SdfWorld world =
      read("<world name='w'><model name='shelf'><link name='l'>" + massless + shape +
           "</link></model><model name='crate'>" + box("l", "1 1 1", "0 0 3 0 0 0") + "</model></world>");
  const SdfCell cell = sdf_cell(world, directory_ / "cell");
  ASSERT_EQ(cell.scenario.grounds.size(), 1U);
  EXPECT_EQ(cell.scenario.grounds[0].name, "shelf");
  ASSERT_EQ(cell.scenario.parts.size(), 1U);
  EXPECT_EQ(cell.scenario.parts[0].name, "crate");
  EXPECT_THAT(cell.notes, Contains(HasSubstr("link 'l': <inertial>: <mass> is 0")));
}

TEST_F(SdfOfOthers, AFileMayHaveSeveralModelsOrIncludeOne) {
  write("models/crate/model.sdf",
        "<sdf version='1.9'><model name='crate'>" + box("l", "1 1 1") + "</model></sdf>");
  options_.packages = {directory_ / "models"};
  const SdfWorld included = read("<include><uri>model://crate</uri><pose>0 0 2 0 0 0</pose></include>");
  EXPECT_EQ(included.name, "crate");
  ASSERT_EQ(included.models.size(), 1U);
  EXPECT_EQ(included.models[0].links.at(0).X_WL.p, Vec3(0, 0, 2));
  const SdfWorld two = read("<model name='a'>" + box("l", "1 1 1") + "</model><model name='b'>" +
                            box("l", "1 1 1") + "</model>");
  ASSERT_EQ(two.models.size(), 2U);
  EXPECT_EQ(two.models[1].name, "b");
}

TEST_F(SdfOfOthers, JointsOfAModelThatIsNotThereAreLeftOut) {
  options_.leave_out_missing = true;
  const SdfWorld world = read("<model name='m'>" + box("l", "1 1 1") +
                              "<include><uri>model://wing</uri><name>left</name></include>"
                              "<include><uri>model://tail</uri></include>\n"
                              "<joint name='j' type='fixed'><parent>l</parent><child>left::l</child></joint>"
                              "<joint name='k' type='fixed'><parent>tail::l</parent><child>l</child></joint>"
                              "</model>");
  EXPECT_THAT(world.models.at(0).joints, IsEmpty());
  EXPECT_THAT(world.notes,
              AllOf(Contains(HasSubstr("line 3: joint 'j' is left out: its <child> 'left::l' is of a model "
                                       "that is not there")),
                    Contains(HasSubstr("joint 'k' is left out: its <parent> 'tail::l'"))));
}

TEST_F(SdfOfOthers, NamesWithinACacheOfFuelAreThoseOfTheCache) {
  const std::string owner = "fuel/fuel.gazebosim.org/openrobotics/models/";
  for (const char* model : {"pallet box/2", "pallet box/10", "lid/1", "lid/3"})
    write(owner + model + "/meshes/a b.obj", kTriangle);
  for (const auto& [uri, place] :
       {std::pair("model://Pallet Box/meshes/a b.obj", "pallet box/2/meshes/a b.obj"),
        std::pair("model://Pallet%20Box/meshes/a%20b.obj", "pallet box/2/meshes/a b.obj"),
        std::pair("model://lid/meshes/a%20b.obj", "lid/3/meshes/a b.obj")})
    EXPECT_EQ(file_of(read(mesh(uri), owner + "pallet box/2/model.sdf")), owner + place) << uri;
}

TEST_F(SdfOfOthers, RelativeNamesAndEscapesAreFound) {
  write("models/wing/meshes/a b.obj", kTriangle);
  options_.packages = {directory_ / "models"};
  for (const char* uri : {"model://wing/meshes/a%20b.obj", "file://wing/meshes/a b.obj",
                          "file://models/wing/meshes/a%20b.obj", "wing/meshes/a%20b.obj"})
    EXPECT_EQ(file_of(read(mesh(uri))), "models/wing/meshes/a b.obj") << uri;
  write("models/wing/model.sdf",
        "<sdf version='1.9'><model name='wing'>" + box("l", "1 1 1") + "</model></sdf>");
  EXPECT_EQ(read("<world name='w'><include><uri>file://wing</uri></include></world>").models.at(0).name,
            "wing");
}

TEST_F(SdfOfOthers, FingersOfAModelAreAGripper) {
  const auto finger = [](const std::string& name, const std::string& y, const std::string& axis) {
    return box(name, "0.02 0.01 0.06", "0 " + y + " 0.6 0 0 0") + "<joint name='" + name +
           "_joint' type='prismatic'><parent>hand</parent><child>" + name + "</child><axis><xyz>0 " + axis +
           " 0</xyz><limit><lower>0</lower><upper>0.04</upper></limit></axis></joint>";
  };
  const auto arm = [&](const std::string& axis_of_right) {
    return "<model name='arm'>" + box("base", "0.3 0.3 0.1") +
           "<joint name='foot' type='fixed'><parent>world</parent><child>base</child></joint>" +
           box("slide", "0.05 0.05 0.2", "0 0 0.3 0 0 0") +
           "<joint name='lift' type='prismatic'><parent>base</parent><child>slide</child><axis><xyz>0 0 "
           "1</xyz>"
           "<limit><lower>0</lower><upper>0.5</upper><effort>100</effort><velocity>1</velocity></limit></"
           "axis>"
           "</joint>" +
           box("hand", "0.05 0.2 0.04", "0 0 0.5 0 0 0") +
           "<joint name='palm' type='fixed'><parent>slide</parent><child>hand</child></joint>" +
           finger("left", "0.005", "1") + finger("right", "-0.005", axis_of_right) + "</model>";
  };
  const auto write_cell = [&](const SdfCell& cell) {
    for (const char* folder : {"cell/meshes", "cell/robots"})
      std::filesystem::create_directories(directory_ / folder);
    for (const auto& [file, objects] : cell.meshes) std::ofstream(file) << obj_text(objects);
    for (const auto& [file, text] : cell.urdfs) std::ofstream(file) << text;
    std::ofstream(cell.scenario.file) << write_scenario(cell.scenario, directory_ / "cell");
  };
  const SdfCell cell = sdf_cell(read(arm("-1")), directory_ / "cell");
  ASSERT_EQ(cell.scenario.grippers.size(), 1U);
  EXPECT_EQ(cell.scenario.grippers[0].robot, "arm");
  EXPECT_THAT(cell.scenario.grippers[0].fingers->joints, ElementsAre("left_joint", "right_joint"));
  EXPECT_THAT(cell.notes, AllOf(Contains(HasSubstr("'left_joint' and 'right_joint' are gripper arm_gripper")),
                                Contains(HasSubstr("'left_joint', a finger, has no velocity; 0.1 m/s")),
                                Contains(HasSubstr("'left_joint', a finger, has no effort; 50 N"))));
  write_cell(cell);
  const auto model = load_cell(cell.scenario.file);
  ASSERT_EQ(model->grippers.size(), 1U);
  // The faces meet at position zero, and each finger travels 40 mm.
  EXPECT_NEAR(model->grippers[0].parameters.max_width_m, 0.08, 1e-9);
  // Joints that both travel to one side are read as candidates, too: the loader refuses them.
  const SdfCell other = sdf_cell(read(arm("1")), directory_ / "cell");
  write_cell(other);
  EXPECT_THROW(load_cell(other.scenario.file), std::exception);
}

}  // namespace
}  // namespace takt
