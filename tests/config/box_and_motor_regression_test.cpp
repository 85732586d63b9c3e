// The situation of thesis 5.4.1: a motor lies in an open box on a table and is gripped out of it. The hull of
// the box fills the box, so that a gripper reaching into it would hold the box as well; its decomposition
// leaves the inside free, and the box stays.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

constexpr double kTable = 0.7;
constexpr double kFloor = 0.012;  // walls and floor of the box are as thick
constexpr double kLift = 0.2;
const Vec3 kBox(0.20, 0.24, 0.10);

struct BoxOutcome {
  Vec3 motor, box;            ///< places at the end
  std::string motor_partner;  // its holder at the end
  std::string box_partner;
  bool box_was_gripped = false;  ///< at any step
  std::vector<ImportNote> notes;
};

/// A gantry with slides along x, y, z; the gripper hangs from it and opens along y.
std::string gantry() {
  const auto slide = [](const char* name, const char* parent, const char* child, const char* axis) {
    return std::string("<joint name='") + name + "' type='prismatic'><parent link='" + parent +
           "'/><child link='" + child + "'/><axis xyz='" + axis +
           "'/><limit lower='-2' upper='2' velocity='1' effort='500'/></joint>";
  };
  return "<robot name='gantry'><link name='base_link'/><link name='x'/><link name='y'/><link name='z'/>"
         "<link name='tool0'/>" +
         slide("slide_x", "base_link", "x", "1 0 0") + slide("slide_y", "x", "y", "0 1 0") +
         slide("slide_z", "y", "z", "0 0 1") +
         "<joint name='flange' type='fixed'><parent link='z'/><child link='tool0'/>"
         "<origin xyz='0 0 0' rpy='3.14159265358979 0 0'/></joint></robot>";
}

BoxOutcome grip_motor_out_of_box(const std::string& convex) {
  const TemporaryDirectory directory;
  directory.write("box.obj", obj_text("box", open_box(kBox, kFloor)));
  std::string by_hand;
  std::size_t vertices = 0;
  for (const TriangleMesh& part : open_box_by_hand(kBox, kFloor)) {
    by_hand += obj_text("part" + std::to_string(vertices), part, vertices);
    vertices += part.vertices.size();
  }
  directory.write("box_convex.obj", by_hand);
  directory.write("motor.obj", obj_text("motor", box_mesh({0.06, 0.06, 0.07})));
  directory.write("table.obj", obj_text("table", box_mesh({0.8, 0.8, 0.04}, {0.0, 0.0, -0.04})));
  directory.write("gantry.urdf", gantry());
  const std::filesystem::path meshes = std::filesystem::path(TAKT_CONFIG_DIR) / "meshes";
  // The pads reach 0.2 m below the flange and end 15 mm above the floor of the box, 18 mm from its walls.
  directory.write(
      "s.yaml",
      "takt_scenario: 1\nname: box_and_motor\nparts:\n"
      "  Motor: {mesh: motor.obj, mass_kg: 0.3, hierarchy: 2, pose: {position_m: [0, 0, 0.712]}}\n"
      "  Box: {mesh: box.obj, mass_kg: 0.5, hierarchy: 3, pose: {position_m: [0, 0, 0.7]}, convex: " +
          convex +
          "}\ngrounds:\n  Table: {mesh: table.obj, pose: {position_m: [0, 0, 0.7]}}\n"
          "robots:\n  Robot: {urdf: gantry.urdf, initial_joints_rad: [0, 0, 0.927]}\n"
          "grippers:\n  Gripper: {robot: Robot, body_mesh: " +
          (meshes / "gripper_body.obj").string() + ", jaw_mesh: " + (meshes / "gripper_jaw.obj").string() +
          ", max_width_m: 0.15, jaw_speed_m_per_s: 0.075, max_force_N: 150}\n");
  const auto cell = load_cell(directory / "s.yaml");
  BoxOutcome outcome;
  outcome.notes = cell->import_notes;
  Simulation simulation(cell);
  const auto id = [&](const char* name) {
    return static_cast<std::size_t>(cell->description.find_component(name));
  };
  const std::size_t motor = id("Motor"), box = id("Box");
  const int palm = cell->description.find_component("Gripper");
  Snapshot snapshot = simulation.make_snapshot();

  const Command close = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
  JointCommand lift;
  lift.robot = 0;
  lift.period_s = 2.0;
  lift.has_velocity = true;
  lift.position = {0.0, 0.0, 0.927 + kLift};
  const Command up = lift;
  for (int step = 0; step < 4000; ++step) {
    // Settle, close at 0.1 s, lift from 1 s to 3 s.
    std::span<const Command> commands;
    if (step == 100) commands = {&close, 1};
    if (step == 1000) commands = {&up, 1};
    EXPECT_TRUE(simulation.step(commands)) << simulation.fault();
    simulation.read_snapshot(snapshot);
    outcome.box_was_gripped = outcome.box_was_gripped || snapshot.components[box].partner == palm;
  }
  const auto partner = [&](std::size_t component) {
    const int holder = snapshot.components[component].partner;
    return holder < 0 ? std::string() : cell->description.components[static_cast<std::size_t>(holder)].name;
  };
  outcome.motor = snapshot.components[motor].p_WB;
  outcome.box = snapshot.components[box].p_WB;
  outcome.motor_partner = partner(motor);
  outcome.box_partner = partner(box);
  return outcome;
}

void expect_only_the_motor_is_gripped(const BoxOutcome& outcome) {
  EXPECT_EQ(outcome.motor_partner, "Gripper");
  EXPECT_LE((outcome.motor - Vec3(0.0, 0.0, kTable + kFloor + kLift)).norm(), 1e-4);
  EXPECT_FALSE(outcome.box_was_gripped);
  EXPECT_EQ(outcome.box_partner, "Table");
  EXPECT_LE((outcome.box - Vec3(0.0, 0.0, kTable)).norm(), 1e-6);
}

TEST(BoxAndMotor, TheBoxIsGrippedTooWithTheHull) {
  const BoxOutcome outcome = grip_motor_out_of_box("hull");
  EXPECT_EQ(outcome.motor_partner, "Gripper");
  EXPECT_TRUE(outcome.box_was_gripped);
  EXPECT_EQ(outcome.box_partner, "Gripper");
  EXPECT_NEAR(outcome.box.z(), kTable + kLift, 1e-3);
  ASSERT_EQ(outcome.notes.size(), 1U) << "this must not happen silently";
  EXPECT_EQ(outcome.notes[0].component, "Box");
}

TEST(BoxAndMotor, TheBoxStaysWithTheDecomposition) {
  if (!decomposition_available()) GTEST_SKIP() << "built without V-HACD";
  const BoxOutcome outcome = grip_motor_out_of_box("{method: vhacd, resolution: 400000}");
  expect_only_the_motor_is_gripped(outcome);
  EXPECT_TRUE(outcome.notes.empty()) << outcome.notes[0].sentence;
}

TEST(BoxAndMotor, TheBoxStaysWithHandMadePieces) {
  const BoxOutcome outcome = grip_motor_out_of_box("box_convex.obj");
  expect_only_the_motor_is_gripped(outcome);
  EXPECT_TRUE(outcome.notes.empty()) << outcome.notes[0].sentence;
}

}  // namespace
}  // namespace takt::test
