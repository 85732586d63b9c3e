// Robots in pictures: the <visual> of their links, placed and coloured as the URDF says.
#include "server/headless/robot_shapes.h"

#include <gtest/gtest.h>

#include <numbers>

#include "server/scenario/urdf_arm.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

constexpr const char* kUrdf = R"(<robot name='r'>
<material name='ink'><color rgba='0.1 0.2 0.3 1'/></material>
<link name='base'><visual><geometry><box size='0.2 0.2 0.2'/></geometry><material name='ink'/></visual></link>
<link name='arm'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>
 <visual><origin xyz='0.5 0 0'/><geometry><box size='0.4 0.1 0.1'/></geometry>
  <material name=''><color rgba='1 0.5 0 1'/></material></visual></link>
<link name='cover'><visual><geometry><mesh filename='missing.dae'/></geometry></visual>
 <collision><geometry><sphere radius='0.3'/></geometry></collision></link>
<link name='panel'><visual><geometry><mesh filename='panel.dae' scale='2 2 2'/></geometry></visual></link>
<link name='tool'/>
<link name='finger'><visual><geometry><sphere radius='9'/></geometry></visual></link>
<joint name='hinge' type='revolute'><parent link='base'/><child link='arm'/><origin xyz='0 0 1'/><axis xyz='0 0 1'/>
 <limit lower='-3' upper='3' effort='1' velocity='1'/></joint>
<joint name='a' type='fixed'><parent link='arm'/><child link='cover'/></joint>
<joint name='b' type='fixed'><parent link='arm'/><child link='panel'/><origin xyz='1 0 0'/></joint>
<joint name='c' type='fixed'><parent link='arm'/><child link='tool'/></joint>
<joint name='d' type='fixed'><parent link='tool'/><child link='finger'/></joint>
</robot>)";

/// A triangle in mm; z points up in the file, whatever it says.
constexpr const char* kPanel = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 100 0 0 0 0 50</float_array><technique_common>
<accessor source="#pa" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="vs"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#vs"/></scene></COLLADA>)";

class RobotShapesOf : public ::testing::Test {
 protected:
  RobotShapesOf() {
    directory_.write("r.urdf", kUrdf);
    directory_.write("panel.dae", kPanel);
    ScenarioRobot& robot = scenario_.robots.emplace_back();
    robot.name = "R";
    robot.urdf = directory_ / "r.urdf";
    robot.base_link = "base";
    robot.flange_link = "tool";
    const UrdfArm arm = read_urdf_arm(robot.urdf, "base", "tool");
    RobotDescription& description = cell_.robots.emplace_back();
    description.name = "R";
    description.arm = arm.arm;
    description.links = arm.links;
    description.X_WR.p = Vec3(10.0, 0.0, 0.0);
  }
  render::Scene drawn(double angle) {
    render::Scene scene;
    EXPECT_TRUE(RobotShapes(scenario_, cell_, {}).add_to(scene, 0, &angle, cell_.robots[0].X_WR));
    return scene;
  }
  static Vec3 middle(const render::Mesh& mesh) {
    Vec3 lower = mesh.X_WB * mesh.vertices.front(), upper = lower;
    for (const Vec3& vertex : mesh.vertices) {
      lower = lower.cwiseMin(mesh.X_WB * vertex);
      upper = upper.cwiseMax(mesh.X_WB * vertex);
    }
    return 0.5 * (lower + upper);
  }
  test::TemporaryDirectory directory_;
  Scenario scenario_;
  CellDescription cell_;
};

TEST_F(RobotShapesOf, LinksAreWhereTheirJointsCarryThem) {
  const render::Scene scene = drawn(0.5 * std::numbers::pi);
  ASSERT_EQ(scene.meshes.size(), 5U);
  EXPECT_LT((middle(scene.meshes[0]) - Vec3(10.0, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((middle(scene.meshes[1]) - Vec3(10.0, 0.5, 1.0)).norm(), 1e-12);
  EXPECT_EQ(scene.meshes[0].color.b, 0.3F) << "of the material that the file names";
  EXPECT_EQ(scene.meshes[1].color.g, 0.5F) << "of its own";
}

TEST_F(RobotShapesOf, AMissingFileLeavesTheShapesOfCollisionChecking) {
  const render::Mesh cover = drawn(0.0).meshes.at(2);
  EXPECT_LT((middle(cover) - Vec3(10.0, 0.0, 1.0)).norm(), 1e-12);
  for (const Vec3& vertex : cover.vertices) EXPECT_NEAR((vertex - Vec3::Zero()).norm(), 0.3, 1e-9);
}

TEST_F(RobotShapesOf, ColladaHasItsUnitAndItsScale) {
  const render::Mesh panel = drawn(0.0).meshes.at(3);
  // 2 x 100 mm along x and 2 x 50 mm along z, 1 m from the hinge.
  EXPECT_LT((middle(panel) - Vec3(11.1, 0.0, 1.05)).norm(), 1e-6);
}

TEST_F(RobotShapesOf, LinksOfAGripperAreLeftOut) {
  ScenarioGripper& gripper = scenario_.grippers.emplace_back();
  gripper.robot = "R";
  gripper.fingers.emplace();
  EXPECT_EQ(drawn(0.0).meshes.size(), 4U);
}

TEST_F(RobotShapesOf, ARobotWhoseFileIsGoneHasNoShapes) {
  scenario_.robots[0].urdf = directory_ / "gone.urdf";
  render::Scene scene;
  const double angle = 0.0;
  EXPECT_FALSE(RobotShapes(scenario_, cell_, {}).add_to(scene, 0, &angle, cell_.robots[0].X_WR));
  EXPECT_TRUE(scene.meshes.empty());
}

}  // namespace
}  // namespace takt
