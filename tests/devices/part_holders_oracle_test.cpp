// Holders against closed forms: pressure, the acceleration at which a Part is lost, diameters, and what remains.
#include "server/devices/part_holders.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/device_cell.h"

namespace takt {
namespace {

using test::DeviceCell;
using ::testing::HasSubstr;
using Kind = DeviceNotice::Kind;

constexpr double kSlideStart_m = 0.3;  // of the slide, positive: down

/// The slide is no faster than 0.2 m/s: a^2 / (2 jerk) at the loss must stay below.
/// Moves the slide up with an acceleration that rises by `jerk`, until a Part is lost; the time from the begin of
/// the motion to the step that began with the loss, or -1.
double lost_after_s(DeviceCell& cell, double jerk_m_per_s3, double at_most_s = 0.2) {
  const double begin = cell.time_s();
  while (cell.count(Kind::part_lost) == 0) {
    const double t = cell.time_s() + DeviceCell::kStep_s - begin;
    if (t > at_most_s) return -1.0;
    cell.slide_to(kSlideStart_m - jerk_m_per_s3 * t * t * t / 6.0, -0.5 * jerk_m_per_s3 * t * t);
    if (!cell.step()) return -1.0;
  }
  return cell.notices().back().time_s - begin;
}
/// Slowly up by this height.
void lift(DeviceCell& cell, double height_m, double seconds) {
  const double begin = cell.time_s();
  for (double s = 0.0; s < 1.0;) {
    s = std::min((cell.time_s() + DeviceCell::kStep_s - begin) / seconds, 1.0);
    cell.slide_to(kSlideStart_m - height_m * (3.0 * s * s - 2.0 * s * s * s),
                  -height_m * (6.0 * s - 6.0 * s * s) / seconds);
    ASSERT_TRUE(cell.step());
  }
}

constexpr double kCupArea_m2 = std::numbers::pi * 0.005 * 0.005;
constexpr double kCup_N = 75000.0 * kCupArea_m2;

TEST(VacuumGripper, ThePressureFollowsItsTimeConstants) {
  DeviceCell cell(DeviceCell::load_device("vacuum_gripper"));
  cell.run(0.05);
  EXPECT_EQ(cell.read("Cup", "sealed_cups"), 0.0);
  cell.set("Cup", "vacuum", 1.0);
  for (int k = 1; k <= 200; ++k) {
    cell.step();
    EXPECT_NEAR(cell.read("Cup", "pressure"), 75000.0 * (1.0 - std::exp(-k * DeviceCell::kStep_s / 0.05)),
                1e-6)
        << k;
    // It holds as soon as the force is the weight, at 83 % of the pressure.
    const bool holds =
        kCup_N * (1.0 - std::exp(-k * DeviceCell::kStep_s / 0.05)) >= 0.5 * DeviceCell::kGravity;
    EXPECT_EQ(cell.read("Cup", "part_present"), holds ? 1.0 : 0.0) << k;
  }
  EXPECT_EQ(cell.read("Cup", "sealed_cups"), 1.0);
  EXPECT_EQ(cell.partner("Block"), "Head");
  EXPECT_EQ(cell.component("Block").state, PartState::grasped);
  EXPECT_NEAR(cell.read("Cup", "load"), 0.5 * DeviceCell::kGravity, 1e-6);
  const double full = cell.read("Cup", "pressure");
  EXPECT_NEAR(cell.read("Cup", "force"), full * kCupArea_m2, 1e-9);
  cell.set("Cup", "vacuum", 0.0);
  for (int k = 1; k <= 20; ++k) {
    cell.step();
    EXPECT_NEAR(cell.read("Cup", "pressure"), full * std::exp(-k * DeviceCell::kStep_s / 0.02), 1e-6) << k;
    // The weight is more than the force as soon as the pressure is below 62.4 kPa.
    if (full * std::exp(-k * DeviceCell::kStep_s / 0.02) * kCupArea_m2 < 0.5 * DeviceCell::kGravity) {
      EXPECT_EQ(cell.read("Cup", "part_present"), 0.0) << k;
    }
  }
  EXPECT_EQ(cell.count(Kind::part_lost), 0U);  // it was switched off
  cell.run(0.1);
  EXPECT_EQ(cell.partner("Block"), "Table");
}

TEST(VacuumGripper, APartIsLostAtTheForceOfTheClosedFormToOneStep) {
  // m (g + a) = dp A, with a = jerk t.
  for (const double jerk : {15.0, 20.0, 24.0}) {
    DeviceCell cell(DeviceCell::load_device("vacuum_gripper"));
    cell.set("Cup", "vacuum", 1.0);
    cell.run(1.5);
    ASSERT_EQ(cell.read("Cup", "part_present"), 1.0);
    const double expected_s = (kCup_N / 0.5 - DeviceCell::kGravity) / jerk;
    EXPECT_NEAR(lost_after_s(cell, jerk), expected_s, DeviceCell::kStep_s) << jerk;
    const DeviceNotice& lost = cell.notices().back();
    EXPECT_GT(lost.load_N, lost.force_N);
    EXPECT_NEAR(lost.load_N, kCup_N, 0.5 * 2.0 * jerk * DeviceCell::kStep_s);
    EXPECT_NEAR(lost.force_N, kCup_N, 1e-6);
    cell.run(0.002);
    EXPECT_EQ(cell.component("Block").state, PartState::free);
    // The cup takes no Part until it has been switched off.
    cell.run(0.5);
    EXPECT_EQ(cell.read("Cup", "part_present"), 0.0);
    EXPECT_EQ(cell.partner("Block"), "Table");
  }
}

TEST(VacuumGripper, APartIsLostAtTheSameForceAtEveryLevelOfDetail) {
  for (const int level : {1, 2, 3}) {
    DeviceCell cell(DeviceCell::load_device("vacuum_gripper", level));
    cell.run(0.3);
    cell.set("Cup", "vacuum", 1.0);
    cell.run(1.0);
    ASSERT_EQ(cell.partner("Block"), "Head") << level;
    EXPECT_NEAR(lost_after_s(cell, 20.0), (kCup_N / 0.5 - DeviceCell::kGravity) / 20.0, DeviceCell::kStep_s)
        << level;
    EXPECT_GT(cell.notices().back().load_N, kCup_N);
  }
}

TEST(VacuumGripper, APartIsLostWhereItsShearExceedsTheFrictionOfTheLips) {
  // The slide lies: its axis is horizontal. m a = mu (dp A - m g).
  const std::string text =
      "solver: {method: rk4}\nparts:\n  Block: {mesh: MESHES/C.obj, mass_kg: 0.5, hierarchy: 1}\n"
      "grounds:\n  Table: {mesh: MESHES/table.obj, convex: objects}\n"
      "robots:\n  Slide: {urdf: ROBOTS/press.urdf, pose: {position_m: [0.55, 0, 0.08], rpy_deg: [0, 90, 0]}, "
      "initial_joints_rad: [0.3]}\n"
      "grippers:\n  Head: {robot: Slide, body_mesh: MESHES/gripper_body.obj, jaw_mesh: "
      "MESHES/gripper_jaw.obj, "
      "max_width_m: 0.15, jaw_speed_m_per_s: 0.1, max_force_N: 100}\n"
      "vacuum_grippers:\n  Cup: {at: Head, mount: {pose: {position_m: [0, 0, 0.25], rpy_deg: [0, 90, 0]}}, "
      "cups: [{diameter_m: 0.010}], pressure_Pa: 75000, friction: 0.5}\n";
  DeviceCell cell(DeviceCell::load_text(text));
  cell.set("Cup", "vacuum", 1.0);
  cell.run(1.5);
  ASSERT_EQ(cell.read("Cup", "part_present"), 1.0);
  const double expected_s = 0.5 * (kCup_N / 0.5 - DeviceCell::kGravity) / 10.0;
  EXPECT_NEAR(lost_after_s(cell, 10.0), expected_s, DeviceCell::kStep_s);
}

TEST(VacuumGripper, SeveralCupsAddAndThoseBesideThePartDoNotSeal) {
  const std::string cups =
      "cups: [{position_m: [0.015, 0, 0], diameter_m: 0.010}, {position_m: [-0.015, 0, 0], "
      "diameter_m: 0.020}, {position_m: [0.028, 0, 0], diameter_m: 0.010}]";
  std::string text =
      "parts:\n  Block: {mesh: MESHES/C.obj, mass_kg: 0.5, hierarchy: 1}\n"
      "grounds:\n  Table: {mesh: MESHES/table.obj, convex: objects}\n"
      "  Above: {mesh: MESHES/P.obj, pose: {position_m: [0, 0, 0.1]}}\n"
      "vacuum_grippers:\n  Cup: {at: Above, mount: {pose: {position_m: [0, 0, -0.02], rpy_deg: [180, 0, "
      "0]}}, " +
      cups + ", pressure_Pa: 50000, leak: 0.2}\n";
  DeviceCell cell(DeviceCell::load_text(text));
  cell.set("Cup", "vacuum", 1.0);
  cell.run(1.5);
  EXPECT_EQ(cell.read("Cup", "sealed_cups"), 2.0);  // the third reaches beyond the edge
  EXPECT_NEAR(cell.read("Cup", "pressure"), 40000.0, 1e-3);
  EXPECT_NEAR(cell.read("Cup", "force"), 40000.0 * std::numbers::pi * (25e-6 + 100e-6), 1e-6);
  EXPECT_EQ(cell.read("Cup", "part"), cell.description().find_component("Block"));
}

TEST(VacuumGripper, ASavedStateAndAResetGoOnWithTheSameBits) {
  const auto model = DeviceCell::load_device("vacuum_gripper");
  DeviceCell cell(model), restored(model);
  const auto rest = [](DeviceCell& now) {
    lift(now, 0.02, 0.4);
    now.set("Cup", "vacuum", 0.0);
    now.run(0.3);
    return now.simulation().state_hash();
  };
  const auto begin = [](DeviceCell& now) {
    now.set("Cup", "vacuum", 1.0);
    now.run(0.5);
  };
  begin(cell);
  std::vector<std::byte> bytes;
  ASSERT_EQ(cell.simulation().save_state(bytes), "");
  const std::uint64_t hash = rest(cell);
  ASSERT_EQ(restored.simulation().restore_state(bytes), "");
  EXPECT_EQ(rest(restored), hash);
  cell.simulation().reset();
  EXPECT_EQ(cell.read("Cup", "part_present"), 0.0);
  begin(cell);
  EXPECT_EQ(rest(cell), hash);
}

/// A cup takes the block, `holder` has it, and the cup lets it go; a second cell goes on from there. `from_m`: its height before.
void let_go(DeviceCell& cell, DeviceCell& restored, const std::string& holder, double& from_m) {
  cell.set("Cup", "vacuum", 1.0);
  cell.run(0.05);
  ASSERT_EQ(cell.partner("Block"), holder);
  from_m = cell.component("Block").p_WB.z();
  cell.set("Cup", "vacuum", 0.0);
  while (cell.read("Cup", "part_present") > 0.0) ASSERT_TRUE(cell.step());
  std::vector<std::byte> bytes;
  ASSERT_EQ(cell.simulation().save_state(bytes), "");
  ASSERT_EQ(restored.simulation().restore_state(bytes), "");
}

TEST(VacuumGripper, APartFallsFromTheGroundThatLetsItGo) {
  const std::string meshes = std::string(TAKT_CONFIG_DIR) + "/meshes/";
  const test::TemporaryDirectory directory;
  directory.write(
      "cell.yaml",
      "takt_scenario: 1\nname: cell\nsolver: {method: rk4}\nparts:\n  Block: {mesh: " + meshes +
          "C.obj, mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0, 0, 0.3]}}\ngrounds:\n  Table: {mesh: " +
          meshes + "table.obj, convex: objects}\n  Above: {mesh: " + meshes +
          "P.obj, pose: {position_m: [0, 0, 0.38]}}\n"
          "vacuum_grippers:\n  Cup: {at: Above, mount: {pose: {rpy_deg: [180, 0, 0]}}, cups: [{diameter_m: "
          "0.02}], pressure_Pa: 50000, evacuation_time_s: 0.001, release_time_s: 1e-4}\n");
  for (const int level : {1, 2, 3}) {
    ScenarioOptions options;
    options.level_of_detail = level;
    const auto model = load_cell(directory.path() / "cell.yaml", options);
    DeviceCell cell(model), restored(model);
    SCOPED_TRACE(level);
    double from_m = 0.0;
    ASSERT_NO_FATAL_FAILURE(let_go(cell, restored, "Above", from_m));
    cell.run(0.2), restored.run(0.2);
    EXPECT_EQ(cell.simulation().state_hash(), restored.simulation().state_hash()) << level;
    const double fallen_m = 0.5 * DeviceCell::kGravity * 0.2 * 0.2;
    EXPECT_NEAR(cell.component("Block").p_WB.z(), from_m - fallen_m, DeviceCell::kGravity * 0.2 * 0.003)
        << level;
    EXPECT_EQ(cell.partner("Block"), "") << level;
    cell.run(0.8);
    EXPECT_EQ(cell.partner("Block"), "Table") << level;
  }
}

// A Ground carries what lies on it: a Part that is let go beside it falls freely, 0.5 g t^2.

/// An object of an OBJ file.
std::string box_object(const std::string& name, const Vec3& lower, const Vec3& upper, int vertices_before) {
  std::string text = "o " + name + "\n";
  for (const double z : {lower.z(), upper.z()})
    for (const auto& [x, y] : {std::pair{lower.x(), lower.y()},
                               {upper.x(), lower.y()},
                               {upper.x(), upper.y()},
                               {lower.x(), upper.y()}})
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
  constexpr int kFaces[12][3] = {{1, 4, 3}, {1, 3, 2}, {5, 6, 7}, {5, 7, 8}, {1, 2, 6}, {1, 6, 5},
                                 {2, 3, 7}, {2, 7, 6}, {3, 4, 8}, {3, 8, 7}, {4, 1, 5}, {4, 5, 8}};
  for (const auto& face : kFaces) {
    text += "f";
    for (const int vertex : face) text += " " + std::to_string(vertex + vertices_before);
    text += "\n";
  }
  return text;
}

constexpr double kHalfBlock_m = 0.0295, kHeight_m = 0.1;

/// A block of 59 mm beside the wall of a corner, at this height above the corner's foot.
class Corner : public testing::TestWithParam<int> {
 protected:
  std::shared_ptr<const CellModel> cell(const std::string& more) {
    const std::string meshes = std::string(TAKT_CONFIG_DIR) + "/meshes/";
    directory_.write("corner.obj", box_object("Wall", {0, -0.05, -0.02}, {0.03, 0.05, 0.3}, 0) +
                                       box_object("Foot", {-0.07, -0.05, -0.02}, {0, 0.05, 0}, 8));
    directory_.write(
        "cell.yaml",
        "takt_scenario: 1\nname: cell\nsolver: {method: rk4}\nparts:\n  Block: {mesh: " + meshes +
            "C.obj, mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0, 0, " + std::to_string(kHeight_m) +
            "]}}\ngrounds:\n  Corner: {mesh: corner.obj, convex: objects, pose: {position_m: [" +
            std::to_string(kHalfBlock_m) + ", 0, 0]}}\n  Above: {mesh: " + meshes +
            "P.obj, pose: {position_m: [0, 0, 0.18]}}\nvacuum_grippers:\n  Cup: {cups: [{diameter_m: 0.02}], "
            "pressure_Pa: 50000, evacuation_time_s: 0.001, release_time_s: 1e-4, " +
            more + "}\n");
    ScenarioOptions options;
    options.level_of_detail = GetParam();
    return load_cell(directory_.path() / "cell.yaml", options);
  }
  /// A cup takes the block and lets it go: it falls freely, and lies on the foot.
  static void falls(const std::shared_ptr<const CellModel>& model, const std::string& holder) {
    DeviceCell cell(model), restored(model);
    double from_m = 0.0;
    ASSERT_NO_FATAL_FAILURE(let_go(cell, restored, holder, from_m));
    constexpr double kFlight_s = 0.1;
    cell.run(kFlight_s), restored.run(kFlight_s);
    EXPECT_EQ(cell.partner("Block"), "");
    EXPECT_NEAR(cell.component("Block").p_WB.z(), from_m - 0.5 * DeviceCell::kGravity * kFlight_s * kFlight_s,
                DeviceCell::kGravity * kFlight_s * 0.003);
    EXPECT_NEAR(cell.component("Block").p_WB.x(), 0.0, 1e-4);
    cell.run(0.4), restored.run(0.4);
    EXPECT_EQ(cell.partner("Block"), "Corner");
    EXPECT_NEAR(cell.component("Block").p_WB.z(), 0.0, 1e-3);
    EXPECT_EQ(cell.simulation().state_hash(), restored.simulation().state_hash());
  }

 private:
  test::TemporaryDirectory directory_;
};
INSTANTIATE_TEST_SUITE_P(Levels, Corner, testing::Values(1, 2));

TEST_P(Corner, APartFallsFromTheWallThatLetsItGo) {
  falls(cell("at: Corner, mount: {pose: {position_m: [0, 0, 0.14], rpy_deg: [0, -90, 0]}}"), "Corner");
}

TEST_P(Corner, APartFallsAlongAWallThatItTouches) {
  falls(cell("at: Above, mount: {pose: {rpy_deg: [180, 0, 0]}}"), "Above");
}

TEST(GroundSupport, APartThatJawsLetGoBesideAWallFalls) {
  const std::string meshes = std::string(TAKT_CONFIG_DIR) + "/meshes/";
  const test::TemporaryDirectory directory;
  directory.write("wall.obj", box_object("Wall", {0, -0.03, 0}, {0.03, 0.03, 0.5}, 0));
  directory.write(
      "cell.yaml",
      "takt_scenario: 1\nname: cell\nsolver: {method: rk4}\nparts:\n  Block: {mesh: " + meshes +
          "C.obj, mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0, 0, 0.7]}}\ngrounds:\n  Table: {mesh: " +
          meshes +
          "table.obj, convex: objects, pose: {position_m: [0, 0, 0.7]}}\n  Wall: {mesh: wall.obj, pose: " +
          "{position_m: [" + std::to_string(kHalfBlock_m) +
          ", 0, 0.7]}}\nrobots:\n  Slide: {urdf: " + TAKT_CONFIG_DIR +
          "/robots/press.urdf, pose: {position_m: [0, 0, 1.23]}, initial_joints_rad: [0.3]}\ngrippers:\n  "
          "Head: "
          "{robot: Slide, body_mesh: " +
          meshes + "gripper_body.obj, jaw_mesh: " + meshes +
          "gripper_jaw.obj, max_width_m: 0.15, initial_width_m: 0.11, jaw_speed_m_per_s: 0.075, max_force_N: "
          "150, grasp: on_command}\n");
  DeviceCell cell(load_cell(directory.path() / "cell.yaml"));
  GripperCommand command;
  command.gripper = 0;
  command.action = GripperAction::close;
  cell.give(command);
  cell.run(0.5);
  ASSERT_EQ(cell.partner("Block"), "Head");
  constexpr double kLift_m = 0.15, kTime_s = 1.5;  // the slide is no faster than 0.2 m/s
  for (double t = DeviceCell::kStep_s; t < kTime_s + 1e-9; t += DeviceCell::kStep_s) {
    const double s = t / kTime_s;
    cell.slide_to(0.3 - kLift_m * s * s * (3.0 - 2.0 * s), -kLift_m * 6.0 * s * (1.0 - s) / kTime_s);
    ASSERT_TRUE(cell.step());
  }
  cell.run(0.2);
  ASSERT_EQ(cell.partner("Block"), "Head");
  const double from_m = cell.component("Block").p_WB.z();
  EXPECT_NEAR(from_m, 0.7 + kLift_m, 0.001);
  command.action = GripperAction::open;
  cell.give(command);
  while (cell.partner("Block") == "Head") ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.partner("Block"), "");
  constexpr double kFlight_s = 0.1;
  cell.run(kFlight_s);
  EXPECT_NEAR(cell.component("Block").p_WB.z(), from_m - 0.5 * DeviceCell::kGravity * kFlight_s * kFlight_s,
              DeviceCell::kGravity * kFlight_s * 0.003);
  cell.run(0.3);
  EXPECT_EQ(cell.partner("Block"), "Table");
}

TEST(MagneticGripper, LosesAPartAtItsForceAndKeepsNoneByTooSmallAResidue) {
  DeviceCell cell(DeviceCell::load_device("magnetic_gripper"));
  cell.set("Magnet", "magnet", 1.0);
  cell.run(0.2);
  EXPECT_EQ(cell.partner("Block"), "Head");
  EXPECT_EQ(cell.read("Magnet", "force"), 8.0);
  cell.set("Magnet", "magnet", 0.0);
  cell.run(0.1);
  EXPECT_EQ(cell.partner("Block"), "Table");
  cell.set("Magnet", "magnet", 1.0);
  cell.run(0.2);
  EXPECT_NEAR(lost_after_s(cell, 110.0), (8.0 / 0.5 - DeviceCell::kGravity) / 110.0, DeviceCell::kStep_s);
}

TEST(ThreeJawGripper, StopsAtTheDiameterOfAPinAndLosesItAtTheFrictionOfItsJaws) {
  DeviceCell cell(DeviceCell::load_device("three_jaw_gripper"));
  cell.set("Chuck", "close", 1.0);
  // From 25 mm to 11.5 mm at 20 mm/s.
  cell.run(0.67);
  EXPECT_EQ(cell.read("Chuck", "part_present"), 0.0);
  cell.run(0.01);
  EXPECT_EQ(cell.read("Chuck", "part_present"), 1.0);
  EXPECT_NEAR(cell.read("Chuck", "diameter"), 0.023, 1e-5);
  EXPECT_EQ(cell.partner("Pin"), "Head");
  cell.run(0.1);
  EXPECT_NEAR(cell.read("Chuck", "load"), 0.1 * DeviceCell::kGravity, 1e-6);
  EXPECT_NEAR(lost_after_s(cell, 190.0), (3.0 * 0.3 * 2.0 / 0.1 - DeviceCell::kGravity) / 190.0,
              DeviceCell::kStep_s);
}

TEST(ThreeJawGripper, HoldsNoPartThatIsOffItsAxis) {
  const std::string text =
      "parts:\n  Pin: {mesh: MESHES/grasping/pin.obj, mass_kg: 0.1, hierarchy: 1, pose: {position_m: [0.004, "
      "0, 0]}}\n"
      "grounds:\n  Table: {mesh: MESHES/table.obj, convex: objects}\n"
      "three_jaw_grippers:\n  Chuck: {at: Table, mount: {pose: {position_m: [0, 0, 0.03]}}, max_diameter_m: "
      "0.05, "
      "jaw_speed_m_per_s: 0.05, force_N: 10}\n";
  DeviceCell cell(DeviceCell::load_text(text));
  cell.set("Chuck", "close", 1.0);
  cell.run(0.5);
  EXPECT_EQ(cell.read("Chuck", "part_present"), 0.0);
  EXPECT_GT(cell.read("Chuck", "diameter"), 0.024);  // one jaw meets the pin
}

TEST(ToolChanger, CouplesAToolWhoseCupTakesAPartAndPutsBothDown) {
  DeviceCell cell(DeviceCell::load_device("tool_changer"));
  cell.run(0.2);
  EXPECT_EQ(cell.partner("Tool"), "Table");
  cell.set("Changer", "couple", 1.0);
  cell.run(0.2);
  EXPECT_EQ(cell.read("Changer", "tool"), 1.0);
  EXPECT_EQ(cell.partner("Tool"), "Head");
  EXPECT_NEAR(cell.read("Changer", "load"), 0.5 * DeviceCell::kGravity, 1e-3);
  cell.set("Cup", "vacuum", 1.0);
  cell.run(0.5);
  EXPECT_EQ(cell.read("Cup", "part_present"), 1.0);
  EXPECT_EQ(cell.partner("Blank"), "Head");
  lift(cell, 0.1, 1.0);
  cell.run(0.2);
  EXPECT_NEAR(cell.component("Tool").p_WB.z(), 0.88, 1e-4);
  EXPECT_NEAR(cell.component("Blank").p_WB.z(), 0.8, 1e-4);
  // The changer carries both.
  EXPECT_NEAR(cell.read("Changer", "load"), 0.8 * DeviceCell::kGravity, 1e-3);
  cell.set("Cup", "vacuum", 0.0);
  cell.run(0.4);
  EXPECT_EQ(cell.partner("Blank"), "Table");
  EXPECT_EQ(cell.partner("Tool"), "Head");
  cell.set("Changer", "couple", 0.0);
  cell.run(0.5);
  EXPECT_EQ(cell.read("Changer", "tool"), 0.0);
  EXPECT_EQ(cell.count(Kind::part_lost), 0U);
  EXPECT_EQ(cell.component("Tool").state == PartState::grasped, false);
}

TEST(PartHolders, MistakesInTheScenarioAreNamed) {
  const auto error_of = [](const std::string& text) {
    try {
      DeviceCell::load_text("grounds:\n  Table: {mesh: MESHES/table.obj}\n" + text);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(error_of("vacuum_grippers:\n  Cup: {at: Desk, cups: [{diameter_m: 0.01}], pressure_Pa: 5e4}\n"),
              HasSubstr("a gripper, a part or a ground"));
  EXPECT_THAT(error_of("vacuum_grippers:\n  Cup: {at: Table, cups: [], pressure_Pa: 5e4}\n"),
              HasSubstr("0 cups"));
  EXPECT_THAT(
      error_of("vacuum_grippers:\n  Cup: {at: Table, cups: [{diameter_m: 0.01}], pressure_Pa: 2e5}\n"),
      HasSubstr("101325"));
}

}  // namespace
}  // namespace takt
