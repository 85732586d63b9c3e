// Worlds of SDFormat as cells, against poses composed by hand and mechanics in closed form.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "plant_models/robot/arm_kinematics.h"
#include "server/geometry/mesh/obj_writer.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_writer.h"
#include "server/scenario/sdf_cell.h"
#include "server/scenario/urdf_arm.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Pose at(double x, double y, double z, double roll = 0.0, double pitch = 0.0, double yaw = 0.0) {
  return {rotation_from_rpy({roll, pitch, yaw}), {x, y, z}};
}
void expect_pose(const Pose& found, const Pose& expected) {
  EXPECT_LT((found.p - expected.p).norm(), 1e-12)
      << found.p.transpose() << " is not " << expected.p.transpose();
  EXPECT_LT((found.R - expected.R).norm(), 1e-12);
}

class SdfWorldOfAFile : public testing::Test {
 protected:
  SdfWorld read(const std::string& inside, const SdfOptions& options = {},
                const std::string& version = "1.9") {
    directory_.write("world.sdf", "<sdf version='" + version + "'>\n" + inside + "\n</sdf>\n");
    return read_sdf(directory_ / "world.sdf", options);
  }
  std::string error(const std::string& inside, const SdfOptions& options = {}) {
    try {
      read(inside, options);
    } catch (const DescriptionError& e) {
      return e.what();
    }
    return "no error";
  }
  /// Writes all files of the cell, as takt-run from-sdf does, and loads it.
  SdfCell load(const SdfWorld& world) {
    for (const char* folder : {"cell/meshes", "cell/robots"})
      std::filesystem::create_directories(directory_ / folder);
    const SdfCell cell = sdf_cell(world, directory_ / "cell");
    for (const auto& [file, objects] : cell.meshes) std::ofstream(file) << obj_text(objects);
    for (const auto& [file, text] : cell.urdfs) std::ofstream(file) << text;
    std::ofstream(cell.scenario.file) << write_scenario(cell.scenario, directory_ / "cell");
    model_ = load_cell(cell.scenario.file);
    return cell;
  }
  test::TemporaryDirectory directory_;
  std::shared_ptr<const CellModel> model_;
};

const SdfLink& link_of(const SdfModel& model, const std::string& name) {
  for (const SdfLink& link : model.links)
    if (link.name == name) return link;
  throw std::runtime_error("no link " + name);
}

TEST_F(SdfWorldOfAFile, PosesAreRelativeToTheFramesThatTheyName) {
  const SdfWorld world = read(R"(<world name='w'>
<frame name='table'><pose>1 2 0.8 0 0 0.5</pose></frame>
<model name='m'>
  <pose relative_to='table'>0.1 0 0.2 0 0 90</pose>
  <frame name='top' attached_to='a'><pose degrees='true'>0 0 0.3 0 90 0</pose></frame>
  <link name='a'><pose>0.4 0 0 0.1 0 0</pose></link>
  <link name='b'><pose relative_to='top'>0 0.5 0 0 0 0.2</pose>
    <visual name='v'><pose relative_to='a'>0 0 1 0 0 0</pose><geometry><sphere><radius>0.1</radius></sphere></geometry></visual>
  </link>
  <link name='c'><pose rotation_format='quat_xyzw'>0 0 0  0 0 2 2</pose></link>
  <link name='d'><pose relative_to='j'/></link>
  <joint name='j' type='fixed'><pose>0.05 0 0 0 0 0</pose><parent>a</parent><child>b</child></joint>
  <model name='n'><pose relative_to='b'>0 0 0.7 0 0 0</pose><link name='e'><pose>0 0.1 0 0 0 0</pose></link></model>
  <link name='f'><pose relative_to='n::e'>1 0 0 0 0 0</pose></link>
</model>
<model name='p' placement_frame='l'><pose relative_to='m::n::e'>0 0 2 0 0 0</pose>
  <link name='l'><pose>3 0 0 0 0 1</pose></link><link name='base'/>
</model>
</world>)");
  ASSERT_EQ(world.models.size(), 2u);
  const SdfModel& m = world.models[0];
  const Pose X_WM = at(1, 2, 0.8, 0, 0, 0.5) * at(0.1, 0, 0.2, 0, 0, 90);
  const Pose X_WA = X_WM * at(0.4, 0, 0, 0.1, 0, 0);
  const Pose X_WB = X_WA * at(0, 0, 0.3, 0, M_PI / 2, 0) * at(0, 0.5, 0, 0, 0, 0.2);
  const Pose X_WJ = X_WB * at(0.05, 0, 0);
  const Pose X_WE = X_WB * at(0, 0, 0.7) * at(0, 0.1, 0);
  expect_pose(link_of(m, "a").X_WL, X_WA);
  expect_pose(link_of(m, "b").X_WL, X_WB);
  expect_pose(link_of(m, "c").X_WL, X_WM * at(0, 0, 0, 0, 0, M_PI / 2));
  expect_pose(link_of(m, "d").X_WL, X_WJ);
  expect_pose(link_of(m, "n::e").X_WL, X_WE);
  expect_pose(link_of(m, "f").X_WL, X_WE * at(1, 0, 0));
  expect_pose(link_of(m, "b").visuals[0].X_LS, X_WB.inverse() * X_WA * at(0, 0, 1));
  ASSERT_EQ(m.joints.size(), 1u);
  expect_pose(m.joints[0].X_WJ, X_WJ);
  // The pose of p is that of its link l.
  const Pose X_WL = X_WE * at(0, 0, 2);
  expect_pose(link_of(world.models[1], "l").X_WL, X_WL);
  expect_pose(link_of(world.models[1], "base").X_WL, X_WL * at(3, 0, 0, 0, 0, 1).inverse());
}

/// The innermost link lies 1 m above the frame of each model around it. Without a result for each model, their number doubles
/// the steps: 60 of them would take years.
TEST_F(SdfWorldOfAFile, NestedModelsMayAllBePlacedByTheInnermostLink) {
  constexpr int kModels = 60;
  std::string text, frame = "l";
  for (int i = kModels - 1; i >= 0; --i) {
    const std::string name = "m" + std::to_string(i);
    text = "<model name='" + name + "' placement_frame='" + frame + "'><pose>0 0 1 0 0 0</pose>" +
           (i == 0 ? "<link name='base'/>" : "") +
           (i == kModels - 1 ? "<link name='l'><pose>3 0 0 0 0 1</pose></link>" : text) + "</model>";
    frame = name + "::" + frame;
  }
  const SdfWorld world = read(text);
  ASSERT_EQ(world.models.size(), 1u);
  for (const SdfLink& link : world.models[0].links)
    expect_pose(link.X_WL, link.name == "base" ? at(0, 0, 0) : at(0, 0, 1));
  EXPECT_EQ(world.models[0].links.size(), 2u);
}

std::string joint_with(const std::string& axis) {
  return "<model name='m'><link name='a'><pose>0 0 0 0 0 1.5707963267948966</pose></link><link "
         "name='b'><pose>0 0 0 "
         "1.5707963267948966 0 0</pose></link><joint name='j' "
         "type='revolute'><parent>a</parent><child>b</child><axis>" +
         axis + "</axis></joint></model>";
}

TEST_F(SdfWorldOfAFile, AxesAreInTheFrameThatTheVersionSays) {
  const auto axis = [&](const std::string& inside, const std::string& version) {
    const Vec3 a = read(joint_with(inside), {}, version).models[0].joints[0].axis;
    return Vec3(a.unaryExpr([](double x) { return std::round(x * 1e12) / 1e12 + 0.0; }));
  };
  // b is turned by 90 degrees about x: its z is -y of the model. a is turned about z: its x is y of the model.
  EXPECT_EQ(axis("<xyz>0 0 2</xyz>", "1.9"), Vec3(0, 0, 1));
  EXPECT_EQ(axis("<xyz expressed_in='__model__'>0 1 0</xyz>", "1.9"), Vec3(0, 0, -1));
  EXPECT_EQ(axis("<xyz expressed_in='a'>1 0 0</xyz>", "1.9"), Vec3(0, 0, -1));
  EXPECT_EQ(axis("<xyz>0 1 0</xyz>", "1.4"), Vec3(0, 0, -1));
  EXPECT_EQ(axis("<xyz>0 1 0</xyz>", "1.6"), Vec3(0, 1, 0));
  EXPECT_EQ(axis("<xyz>0 1 0</xyz><use_parent_model_frame>1</use_parent_model_frame>", "1.6"),
            Vec3(0, 0, -1));
}

const std::string kBox = "<geometry><box><size>0.2 0.4 0.6</size></box></geometry>";
std::string inertial(double mass, double xx, double yy, double zz) {
  return "<inertial><mass>" + std::to_string(mass) + "</mass><inertia><ixx>" + std::to_string(xx) +
         "</ixx><iyy>" + std::to_string(yy) + "</iyy><izz>" + std::to_string(zz) +
         "</izz></inertia></inertial>";
}

TEST_F(SdfWorldOfAFile, StaticModelsAreGroundsAndFreeOnesParts) {
  const SdfCell cell = load(read(
      "<world name='my world'><gravity>0 0 -1.62</gravity><light name='sun' type='directional'/>"
      "<model name='ground_plane'><static>true</static><link name='link'><collision "
      "name='c'><geometry><plane>"
      "<normal>0 0 1</normal><size>4 5</size></plane></geometry></collision></link></model>"
      "<model name='crate'><pose>0 0 1.3 0 0 0.3</pose><link name='body'>" +
      inertial(3, 0.13, 0.1, 0.05) + "<collision name='c'>" + kBox + "</collision><visual name='v'>" + kBox +
      "<material><diffuse>1 0.5 0 1</diffuse></material></visual></link></model>"
      "<model name='crate below'><pose>0 0 0.3 0 0 0</pose><link name='body'>" +
      inertial(3, 0.13, 0.1, 0.05) + "<collision name='c'>" + kBox +
      "</collision><sensor name='s' type='imu'/></link></model></world>"));
  ASSERT_EQ(cell.scenario.grounds.size(), 1u);
  ASSERT_EQ(cell.scenario.parts.size(), 2u);
  EXPECT_EQ(cell.scenario.name, "my_world");
  const ScenarioPart& crate = cell.scenario.parts[0];
  EXPECT_EQ(crate.name, "crate");
  expect_pose(crate.X_WB, at(0, 0, 1.3, 0, 0, 0.3));
  EXPECT_EQ(crate.color, (std::array<float, 4>{1.0F, 0.5F, 0.0F, 1.0F}));
  EXPECT_LT(crate.hierarchy, cell.scenario.parts[1].hierarchy);  // what lies below has the higher number
  EXPECT_EQ(cell.scenario.parts[1].name, "crate_below");
  // The cell that the files load as.
  ASSERT_NE(model_, nullptr);
  EXPECT_EQ(model_->description.gravity_m_per_s2, Vec3(0, 0, -1.62));
  const Component& body = model_->components[static_cast<std::size_t>(model_->parts[0].body)];
  EXPECT_EQ(body.mass_kg, 3.0);
  EXPECT_LT((body.I_BBcm_B - Vec3(0.13, 0.1, 0.05).asDiagonal().toDenseMatrix()).norm(), 1e-12);
  EXPECT_LT((body.box.half_B - Vec3(0.1, 0.2, 0.3)).norm(), 1e-9);
  // The plate's upper side is the plane.
  const Component& ground = model_->components[static_cast<std::size_t>(model_->grounds[0].component)];
  EXPECT_LT((ground.box.center_B + ground.box.half_B - Vec3(2.0, 2.5, 0.0)).norm(), 1e-9);
  EXPECT_THAT(cell.notes, testing::Contains(HasSubstr("the endless plane is a plate of 4 m x 5 m")));
  EXPECT_THAT(cell.notes, testing::Contains(HasSubstr("<light> is left out (1)")));
  EXPECT_THAT(cell.notes, testing::Contains(HasSubstr("<sensor> is left out (1)")));
}

TEST_F(SdfWorldOfAFile, LinksOnFixedJointsAreOneBody) {
  const SdfCell cell = load(read(
      "<model name='dumbbell'><link name='a'>" + inertial(2, 0.01, 0.02, 0.03) + "<collision name='c'>" +
      kBox + "</collision></link><link name='b'><pose>1 0 0 0 0 0</pose>" + inertial(2, 0.01, 0.02, 0.03) +
      "<collision name='c'>" + kBox +
      "</collision></link><joint name='j' type='fixed'><parent>a</parent><child>b</child></joint></model>"));
  ASSERT_EQ(cell.scenario.parts.size(), 1u);
  const ScenarioPart& part = cell.scenario.parts[0];
  EXPECT_EQ(part.name, "dumbbell");
  EXPECT_EQ(part.mass_kg, 4.0);
  EXPECT_LT((*part.center_of_mass_m - Vec3(0.5, 0, 0)).norm(), 1e-12);
  // Steiner: 2 * 2 kg * (0.5 m)^2 about y and z.
  EXPECT_LT((*part.inertia_kg_m2 - Vec3(0.02, 0.04 + 1.0, 0.06 + 1.0).asDiagonal().toDenseMatrix()).norm(),
            1e-9);
}

TEST_F(SdfWorldOfAFile, ModelsWithMovingJointsAreRobots) {
  const std::string limit =
      "<limit><lower>-2</lower><upper>2</upper><effort>50</effort><velocity>1.5</velocity></limit>";
  const SdfCell cell = load(read(
      "<world name='w'><model name='arm'><pose>0.5 0 0.2 0 0 0</pose>"
      "<link name='base'><collision name='c'>" +
      kBox +
      "</collision></link>"
      "<joint name='foot' type='fixed'><parent>world</parent><child>base</child></joint>"
      "<link name='upper'><pose>0 0 0.5 0 0.3 0</pose>" +
      inertial(1, 0.01, 0.01, 0.01) +
      "</link>"
      "<joint name='shoulder' type='revolute'><pose>0 0.1 0 0 0 "
      "0</pose><parent>base</parent><child>upper</child><axis>"
      "<xyz>0 1 0</xyz>" +
      limit +
      "</axis></joint>"
      "<link name='slide'><pose relative_to='upper'>0 0 0.4 0 0 0</pose>" +
      inertial(1, 0.01, 0.01, 0.01) +
      "</link>"
      "<joint name='lift' type='prismatic'><parent>upper</parent><child>slide</child><axis><xyz>0 0 1</xyz>"
      "<limit><lower>0.1</lower><upper>0.6</upper></limit></axis></joint>"
      "<link name='left'><pose relative_to='slide'>0 0.05 0.1 0 0 0</pose>" +
      inertial(0.1, 1e-3, 1e-3, 1e-3) +
      "</link>"
      "<joint name='l' type='prismatic'><parent>slide</parent><child>left</child><axis><xyz>0 1 0</xyz>" +
      limit + "</axis></joint><link name='right'><pose relative_to='slide'>0 -0.05 0.1 0 0 0</pose>" +
      inertial(0.1, 1e-3, 1e-3, 1e-3) +
      "</link><joint name='r' type='prismatic'><parent>slide</parent><child>right</child>"
      "<axis><xyz>0 -1 0</xyz>" +
      limit + "</axis></joint></model></world>"));
  ASSERT_EQ(cell.scenario.robots.size(), 1u);
  const ScenarioRobot& robot = cell.scenario.robots[0];
  EXPECT_EQ(robot.base_link, "base");
  EXPECT_EQ(robot.flange_link, "slide");  // the joints branch there
  EXPECT_THAT(robot.initial_joints_rad, ElementsAre(0.0, 0.1));
  expect_pose(robot.X_WR, at(0.5, 0, 0.2));
  const UrdfArm arm = read_urdf_arm(robot.urdf, robot.base_link, robot.flange_link);
  ASSERT_EQ(arm.arm.joint_count(), 2);
  EXPECT_EQ(arm.arm.joints[0].max_velocity, 1.5);
  EXPECT_EQ(arm.arm.joints[0].max_effort, 50.0);
  EXPECT_THAT(arm.standing_joints, ElementsAre("l", "r"));
  // The shoulder is 0.1 m beside the link, whose y it turns about.
  for (const auto& [q, d] : {std::pair{0.0, 0.0}, std::pair{0.7, 0.25}}) {
    ArmPoses poses;
    forward_kinematics(arm.arm, JointArray{q, d}.data(), poses);
    expect_pose(robot.X_WR * poses.X_RF,
                at(0.5, 0, 0.2) * at(0, 0, 0.5, 0, 0.3, 0) * at(0, 0, 0, 0, q, 0) * at(0, 0, 0.4 + d));
  }
  const UrdfInertias inertias = urdf_inertias(arm);
  ASSERT_EQ(inertias.links.size(), 2u);
  // The upper link's centre is in the joint's frame.
  EXPECT_LT((inertias.links[0].p_BBcm_B - Vec3(0, -0.1, 0)).norm(), 1e-12);
  EXPECT_NEAR(inertias.links[1].mass_kg, 1.2, 1e-12);
}

class SdfModels : public SdfWorldOfAFile {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(directory_ / "models/crate");
    directory_.write("models/crate/model.config",
                     "<model><name>Crate</name><sdf version='1.4'>old.sdf</sdf><sdf "
                     "version='1.6'>model.sdf</sdf></model>");
    directory_.write("models/crate/old.sdf",
                     "<sdf version='1.4'><model name='old'><link name='l'/></model></sdf>");
    directory_.write(
        "models/crate/model.sdf",
        "<sdf version='1.6'><model name='crate'><pose>0 0 9 0 0 0</pose><link name='l'><pose>0 0 1 0 0 0"
        "</pose><collision name='c'>" +
            kBox + "</collision></link></model></sdf>");
    options_.packages = {directory_ / "models"};
  }
  SdfOptions options_;
};

TEST_F(SdfModels, AreIncludedByTheirNames) {
  const SdfWorld world = read(
      "<world name='w'><include><uri>model://crate</uri></include><include><uri>\n model://crate "
      "</uri><name>second</name>"
      "<static>1</static><pose>1 0 0 0 0 0</pose></include>"
      "<include><uri>https://fuel.gazebosim.org/1.0/owner/models/crate</uri><name>third</name></include>"
      "<model name='shelf'><include><uri>models/crate</uri><pose>0 0 5 0 0 "
      "0</pose></include></model></world>",
      options_);
  ASSERT_EQ(world.models.size(), 4u);
  EXPECT_EQ(world.models[0].name, "crate");
  expect_pose(world.models[0].links[0].X_WL, at(0, 0, 10));
  EXPECT_EQ(world.models[1].name, "second");
  EXPECT_TRUE(world.models[1].is_static);
  expect_pose(world.models[1].links[0].X_WL, at(1, 0, 1));
  EXPECT_EQ(world.models[2].name, "third");
  EXPECT_EQ(world.models[3].links[0].name, "crate::l");
  expect_pose(world.models[3].links[0].X_WL, at(0, 0, 6));
}

TEST_F(SdfModels, OfACacheOfFuelAreThoseOfTheirVersion) {
  // As gz fuel download writes them: names in small letters, a folder for each version.
  const std::string place = "fuel/fuel.gazebosim.org/openrobotics/models/pallet box/";
  for (const auto& [version, z] : {std::pair{"2", "2"}, std::pair{"9", "9"}, std::pair{"10", "10"}}) {
    std::filesystem::create_directories(directory_ / (place + version + "/meshes"));
    directory_.write(place + version + "/model.config",
                     "<model><name>Pallet Box</name><sdf version='1.6'>model.sdf</sdf></model>");
    directory_.write(place + version + "/meshes/box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    directory_.write(place + version + "/model.sdf",
                     "<sdf version='1.6'><model name='pallet'><link name='l'><pose>0 0 " + std::string(z) +
                         " 0 0 0</pose><collision name='c'>" + kBox + "</collision></link></model></sdf>");
  }
  options_.packages.push_back(directory_ / "fuel");
  const std::string at_server = "https://fuel.gazebosim.org/1.0/OpenRobotics/models/Pallet%20Box";
  for (const auto& [behind, z] : {std::pair{"", 10.0}, std::pair{"/tip", 10.0}, std::pair{"/9", 9.0}}) {
    const SdfWorld world =
        read("<world name='w'><include><uri>" + at_server + behind + "</uri></include></world>", options_);
    ASSERT_EQ(world.models.size(), 1u) << behind;
    expect_pose(world.models[0].links[0].X_WL, at(0, 0, z));
  }
  EXPECT_THAT(error("<world name='w'><include><uri>" + at_server + "/3</uri></include></world>", options_),
              HasSubstr("/3', which is not there"));
  const SdfWorld world =
      read("<model name='m'><link name='l'><collision name='c'><geometry><mesh><uri>" + at_server +
               "/2/files/meshes/box.obj</uri></mesh></geometry></collision>" + "</link></model>",
           options_);
  EXPECT_EQ(world.models.size(), 1u);
  EXPECT_THAT(world.notes, IsEmpty());
}

TEST_F(SdfModels, ThatAreMissingAreReported) {
  const std::string missing = "<world name='w'>\n<include><uri>model://pallet</uri></include></world>";
  EXPECT_THAT(error(missing, options_),
              AllOf(HasSubstr("world.sdf: line 3: <uri>: found 'model://pallet', which is not there"),
                    HasSubstr("a model 'pallet' in the folders of --packages or GZ_SIM_RESOURCE_PATH")));
  options_.leave_out_missing = true;
  const SdfWorld world = read(missing, options_);
  EXPECT_THAT(world.models, IsEmpty());
  EXPECT_THAT(world.notes,
              ElementsAre(HasSubstr("line 3: <uri>: found 'model://pallet', which is not there; left out")));
  // A model that includes itself.
  directory_.write(
      "models/crate/model.sdf",
      "<sdf version='1.6'><model name='crate'><include><uri>model://crate</uri></include></model></sdf>");
  EXPECT_THAT(error("<world name='w'><include><uri>model://crate</uri></include></world>", options_),
              HasSubstr("models include each other more than 16 levels deep"));
}

TEST_F(SdfWorldOfAFile, MistakesAreNamedWithTheirLine) {
  const auto model = [](const std::string& inside) { return "<model name='m'>\n" + inside + "</model>"; };
  const auto shape = [&](const std::string& geometry) {
    return model("<link name='l'><collision name='c'><geometry>" + geometry +
                 "</geometry></collision></link>");
  };
  const std::pair<std::string, std::string> mistakes[] = {
      {"<thing/>", "line 1: <sdf>: found neither <world>, <model> nor <include>"},
      {"<model><link name='l'/></model>", "line 2: <model>: name: found nothing"},
      {model("<link name='l'/><link name='l'/>"), "line 3: <link>: name: found 'l' a second time"},
      {model("<link name='l'><pose>0 0 0 0 0</pose></link>"),
       "line 3: <pose>: found '0 0 0 0 0'; allowed: 6 finite numbers"},
      {model("<link name='l'><pose>0 0 nan 0 0 0</pose></link>"), "allowed: 6 finite numbers"},
      {model("<link name='l'><pose relative_to='x'>0 0 0 0 0 0</pose></link>"),
       "<link>: found 'x', which is no frame here; allowed: l"},
      {model("<link name='a'><pose relative_to='b'/></link><link name='b'><pose relative_to='a'/></link>"),
       "its pose is relative to itself by other frames"},
      {model("<link name='a'/><joint name='j' type='hinge'><parent>world</parent><child>a</child></joint>"),
       "joint 'j': type: found 'hinge'; allowed: fixed, revolute, continuous, prismatic, ball"},
      {model("<link name='a'/><joint name='j' type='fixed'><parent>world</parent><child>b</child></joint>"),
       "found 'b', which is no frame here"},
      {model("<link name='a'/><joint name='j' "
             "type='revolute'><parent>world</parent><child>a</child><axis><xyz>0 0 0</xyz>"
             "</axis></joint>"),
       "<xyz>: found '0 0 0'; allowed: a vector with a direction"},
      {shape("<box><size>1 1</size></box>"),
       "line 3: link 'l': <collision>: <box>: <size>: found '1 1'; allowed: 3 finite numbers"},
      {shape("<sphere><radius>-1</radius></sphere>"),
       "<sphere>: <radius>: found '-1'; allowed: a number > 0"},
      {shape("<torus/>"), "<geometry>: found <torus>; allowed: box, sphere"},
      {shape("<mesh><uri>none.stl</uri></mesh>"),
       "<uri>: found 'none.stl', which is not there; allowed: a file beside this one"}};
  for (const auto& [text, expected] : mistakes)
    EXPECT_THAT(error(text), AllOf(HasSubstr("world.sdf: "), HasSubstr(expected))) << text;
  const auto whole = [&](const std::string& text) {
    directory_.write("world.sdf", text);
    try {
      read_sdf(directory_ / "world.sdf");
    } catch (const DescriptionError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  for (const std::string version : {"2.0", "1.", "1.e10", "1.1e1", "1.9 ", "1.100"})
    EXPECT_THAT(whole("<sdf version='" + version + "'/>"),
                HasSubstr("line 1: <sdf>: version: found '" + version + "'; allowed: 1.0 to 1.12"));
  EXPECT_THAT(whole("<robot name='r'/>"), HasSubstr("found <robot>: a URDF file"));
  EXPECT_THAT(whole("<sdf version='1.9'>\n<world"), HasSubstr("not well-formed XML"));
}

}  // namespace
}  // namespace takt
