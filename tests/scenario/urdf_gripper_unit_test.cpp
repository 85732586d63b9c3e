// Grippers out of the fingers of a URDF, against figures by hand.
#include "server/scenario/urdf_gripper.h"

#include <gmock/gmock.h>

#include <cmath>

#include "idl/common/text.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

std::string link_of(const std::string& name, const std::string& inside = "") {
  return "<link name='" + name + "'>" + inside + "</link>\n";
}
std::string box_of(const std::string& tag, const std::string& size, const std::string& at = "0 0 0") {
  return "<" + tag + "><origin xyz='" + at + "'/><geometry><box size='" + size + "'/></geometry></" + tag +
         ">";
}
std::string mass_of(double kg) {
  return "<inertial><mass value='" + std::to_string(kg) +
         "'/><inertia ixx='1e-3' ixy='0' ixz='0' iyy='1e-3' iyz='0' izz='1e-3'/></inertial>";
}
std::string joint_of(const std::string& name, const std::string& type, const std::string& parent,
                     const std::string& child, const std::string& inside) {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
         child + "'/>" + inside + "</joint>\n";
}

/// A lift with a hand as a Panda has it: turned by 45 degrees on the flange, fingers 58.4 mm above the palm, which travel
/// by 40 mm each. The pads are 1 mm apart at position zero.
std::string panda_like(const std::string& second_axis = "0 -1 0",
                       const std::string& limits = "upper='0.04' effort='20'") {
  const std::string travel = "<limit lower='0' " + limits + " velocity='0.2'/>";
  return "<robot name='r'>" + link_of("base", box_of("collision", "0.2 0.2 0.1")) +
         link_of("arm", box_of("collision", "0.05 0.05 0.2") + mass_of(2.0)) + link_of("flange") +
         link_of("hand", box_of("collision", "0.06 0.2 0.06", "0 0 0.03") + mass_of(0.7)) +
         link_of("hand_tcp") +
         link_of("left", box_of("collision", "0.02 0.01 0.05", "0 0.0055 0.025") + mass_of(0.05)) +
         link_of("right", box_of("visual", "0.02 0.01 0.05", "0 -0.0055 0.025") + mass_of(0.05)) +
         joint_of("lift", "prismatic", "base", "arm",
                  "<origin xyz='0 0 0.3'/><axis xyz='0 0 1'/><limit lower='0' upper='1' effort='500' "
                  "velocity='1'/>") +
         joint_of("to_flange", "fixed", "arm", "flange",
                  "<origin xyz='0 0 -0.1' rpy='3.141592653589793 0 0'/>") +
         joint_of("to_hand", "fixed", "flange", "hand", "<origin rpy='0 0 -0.7853981633974483'/>") +
         joint_of("to_tcp", "fixed", "hand", "hand_tcp", "<origin xyz='0 0 0.1034'/>") +
         joint_of("finger1", "prismatic", "hand", "left",
                  "<origin xyz='0 0 0.0584'/><axis xyz='0 1 0'/>" + travel) +
         joint_of("finger2", "prismatic", "hand", "right",
                  "<origin xyz='0 0 0.0584'/><axis xyz='" + second_axis + "'/>" + travel +
                      "<mimic joint='finger1'/>") +
         "</robot>\n";
}

class UrdfGripperOfAFile : public testing::Test {
 protected:
  UrdfGripper read(const std::string& text, const std::vector<std::string>& fingers = {}) {
    directory_.write("r.urdf", text);
    return urdf_gripper(read_urdf_arm(directory_ / "r.urdf", "base", "flange"), "flange", fingers);
  }
  std::string error(const std::string& text, const std::vector<std::string>& fingers = {}) {
    try {
      read(text, fingers);
    } catch (const UrdfError& e) {
      return e.what();
    }
    return "no error";
  }
  test::TemporaryDirectory directory_;
};

TEST_F(UrdfGripperOfAFile, HasTheFiguresOfTheFile) {
  const UrdfGripper gripper = read(panda_like());
  EXPECT_NEAR(gripper.max_width_m, 0.001 + 2 * 0.04, 1e-12);
  EXPECT_EQ(gripper.jaw_speed_m_per_s, 0.2);
  EXPECT_EQ(gripper.max_force_N, 20.0);
  EXPECT_NEAR(gripper.mass_kg, 0.8, 1e-12);
  EXPECT_NEAR(gripper.jaw_mass_kg, 0.05, 1e-12);
  EXPECT_THAT(gripper.links, UnorderedElementsAre("hand", "hand_tcp", "left", "right"));
  EXPECT_THAT(gripper.joints, UnorderedElementsAre("finger1", "finger2"));
  EXPECT_THAT(gripper.remarks, ElementsAre());
  EXPECT_LT(gripper.X_FG.p.norm(), 1e-12);
  EXPECT_LT((gripper.X_FG.R - Eigen::AngleAxisd(-M_PI / 4, Vec3::UnitZ()).toRotationMatrix()).norm(), 1e-12);
  EXPECT_LT((gripper.X_GT.p - Vec3(0.0, 0.0, 0.1034)).norm(), 1e-12);
  ASSERT_EQ(gripper.jaw.size(), 1U);
  const Aabb jaw = bounds_of(gripper.jaw[0].mesh), body = bounds_of(gripper.body[0].mesh);
  EXPECT_LT((jaw.lower - Vec3(-0.01, 0.0, 0.0584)).norm(), 1e-12);
  EXPECT_LT((jaw.upper - Vec3(0.01, 0.01, 0.1084)).norm(), 1e-12);
  EXPECT_LT((body.upper - Vec3(0.03, 0.1, 0.06)).norm(), 1e-12);
  EXPECT_TRUE(check_closed(gripper.jaw[0].mesh).ok());
}

TEST_F(UrdfGripperOfAFile, TheNamedOrderMakesTheLeftFinger) {
  const UrdfGripper gripper = read(panda_like(), {"finger2", "finger1"});
  const Mat3 turned =
      (Eigen::AngleAxisd(-M_PI / 4, Vec3::UnitZ()) * Eigen::AngleAxisd(M_PI, Vec3::UnitZ())).matrix();
  EXPECT_LT((gripper.X_FG.R - turned).norm(), 1e-12);
}

TEST_F(UrdfGripperOfAFile, OtherFingersAreRefused) {
  EXPECT_THAT(error(panda_like("0 1 0")),
              HasSubstr("'finger1' and 'finger2' do not travel in opposite directions"));
  EXPECT_THAT(error(panda_like("1 0 0")), HasSubstr("do not travel in opposite directions"));
  EXPECT_THAT(error(panda_like(), {"finger1", "lift"}),
              AllOf(HasSubstr("joint 'lift'"), HasSubstr("those are 'finger1', 'finger2'")));
  EXPECT_THAT(error(panda_like(), {"finger1", "none"}), HasSubstr("found 1 joints"));
}

/// A lift that carries a palm with two cranks of length r = 60 mm, 20 mm beside the middle. The crank of the left finger is
/// upright where the drive is at 0. Pads stand upright at all positions; their joints are turned by 0.3 rad against the
/// cranks. The pads meet where the cranks lean inward by asin(1/3).
std::string four_bar(const std::string& left_tip = "<mimic joint='drive' multiplier='-1' offset='0.3'/>",
                     const std::string& right_crank = "<mimic joint='drive' multiplier='-1'/>") {
  const auto limit = [](const char* range) {
    return std::string("<limit ") + range + " effort='6' velocity='0.5'/>";
  };
  const std::string about_x = "<axis xyz='-1 0 0'/>", wide = limit("lower='-2' upper='2'");
  const std::string crank = box_of("collision", "0.01 0.01 0.06", "0 0 0.03") + mass_of(0.02);
  return "<robot name='r'>" + link_of("base", box_of("collision", "0.2 0.2 0.1")) +
         link_of("palm", box_of("collision", "0.06 0.1 0.05", "0 0 -0.025") + mass_of(0.5)) +
         link_of("left_crank", crank) + link_of("right_crank", crank) +
         link_of("left_pad", box_of("collision", "0.02 0.01 0.04", "0 0.005 0.02") + mass_of(0.03)) +
         link_of("right_pad", box_of("collision", "0.02 0.01 0.04", "0 -0.005 0.02") + mass_of(0.03)) +
         joint_of("lift", "prismatic", "base", "palm",
                  "<origin xyz='0 0 0.3'/><axis xyz='0 0 1'/><limit lower='0' upper='1' effort='500' "
                  "velocity='1'/>") +
         joint_of("drive", "revolute", "palm", "left_crank",
                  "<origin xyz='0 0.02 0'/>" + about_x + limit("lower='-0.4' upper='0.6'")) +
         joint_of("right_drive", "revolute", "palm", "right_crank",
                  "<origin xyz='0 -0.02 0'/>" + about_x + wide + right_crank) +
         joint_of("left_tip", "revolute", "left_crank", "left_pad",
                  "<origin xyz='0 0 0.06' rpy='0.3 0 0'/>" + about_x + wide + left_tip) +
         joint_of("right_tip", "revolute", "right_crank", "right_pad",
                  "<origin xyz='0 0 0.06' rpy='-0.3 0 0'/>" + about_x + wide +
                      "<mimic joint='right_drive' multiplier='-1' offset='-0.3'/>") +
         "</robot>\n";
}

class UrdfGripperOfALinkage : public UrdfGripperOfAFile {
 protected:
  UrdfGripper read_linkage(const std::string& text, const std::vector<std::string>& fingers = {}) {
    directory_.write("r.urdf", text);
    return urdf_gripper(read_urdf_arm(directory_ / "r.urdf", "base", "palm"), "palm", fingers);
  }
  std::string linkage_error(const std::string& text, const std::vector<std::string>& fingers = {}) {
    try {
      read_linkage(text, fingers);
    } catch (const UrdfError& e) {
      return e.what();
    }
    return "no error";
  }
};

TEST_F(UrdfGripperOfALinkage, OpensAsItsCranksDo) {
  const UrdfGripper gripper = read_linkage(four_bar());
  const double r = 0.06, open = r * std::sin(0.6), closed = r * std::sin(-0.4),
               middle = 0.5 * (open + closed);
  EXPECT_NEAR(gripper.max_width_m, 2.0 * (0.02 + open), 1e-12);
  EXPECT_NEAR(gripper.jaw_speed_m_per_s, (open - closed) / 1.0 * 0.5, 1e-12);
  EXPECT_NEAR(gripper.max_force_N, 6.0 / (2.0 * r), 1e-2);  // least where a crank is upright
  EXPECT_NEAR(gripper.mass_kg, 0.5 + 2 * (0.02 + 0.03), 1e-12);
  EXPECT_NEAR(gripper.jaw_mass_kg, 0.03, 1e-12);
  EXPECT_THAT(gripper.links,
              UnorderedElementsAre("palm", "left_crank", "right_crank", "left_pad", "right_pad"));
  EXPECT_THAT(gripper.joints, UnorderedElementsAre("drive", "right_drive", "left_tip", "right_tip"));
  // G is upright on the palm, y to the left finger. The pad is where half of the opening is left.
  EXPECT_LT((gripper.X_FG.R - Mat3::Identity()).norm(), 1e-12);
  EXPECT_LT(gripper.X_FG.p.norm(), 1e-12);
  const double height = std::sqrt(r * r - middle * middle);
  ASSERT_EQ(gripper.jaw.size(), 1u);
  const Aabb pad = bounds_of(gripper.jaw[0].mesh);
  EXPECT_LT((pad.lower - Vec3(-0.01, 0.0, height)).norm(), 1e-9);
  EXPECT_LT((pad.upper - Vec3(0.01, 0.01, height + 0.04)).norm(), 1e-9);
  ASSERT_EQ(gripper.body.size(), 3u);  // palm and cranks
  // What takt does not model: both rises, from cos and from the middle.
  ASSERT_EQ(gripper.remarks.size(), 1u);
  EXPECT_THAT(gripper.remarks[0],
              AllOf(HasSubstr("r.urdf: line "),
                    HasSubstr(number_text(height - r * std::cos(0.6), 3) + " m when they open"),
                    HasSubstr(number_text(height - r * std::cos(0.4), 3) + " m when they close")));
}

TEST_F(UrdfGripperOfALinkage, TheFirstNamedFingerIsTheLeftOne) {
  const UrdfGripper gripper = read_linkage(four_bar(), {"right_tip", "left_tip"});
  EXPECT_NEAR(gripper.max_width_m, 2.0 * (0.02 + 0.06 * std::sin(0.6)), 1e-12);
  EXPECT_LT((gripper.X_FG.R - Vec3(-1.0, -1.0, 1.0).asDiagonal().toDenseMatrix()).norm(), 1e-12);
}

TEST_F(UrdfGripperOfALinkage, OthersAreRefusedWithWhatToWrite) {
  EXPECT_THAT(linkage_error(four_bar("<mimic joint='drive' multiplier='-0.5'/>")),
              AllOf(HasSubstr("found 1 joints"), HasSubstr("'left_tip' turns its link by 0.5 rad"),
                    HasSubstr("state body_mesh, jaw_mesh, max_width_m")));
  EXPECT_THAT(linkage_error(
                  four_bar("<mimic joint='drive' multiplier='-1' offset='0.3'/>", "<mimic joint='drive'/>")),
              AllOf(HasSubstr("'drive' moves the fingers 'left_tip' and 'right_tip' by the same way"),
                    HasSubstr("opposite")));
  EXPECT_THAT(linkage_error(four_bar("<mimic joint='drive' multiplier='-1' offset='0.3'/>", "")),
              HasSubstr("the fingers follow the joints 'drive' and 'right_drive'"));
  EXPECT_THAT(linkage_error(four_bar(), {"left_tip", "drive"}), HasSubstr("'drive'"));
  EXPECT_THAT(linkage_error(four_bar(), {"left_tip", "lift"}),
              HasSubstr("found 'lift'; allowed: the moving joints below the flange, 'drive', 'right_drive'"));
  EXPECT_THAT(linkage_error(four_bar("<mimic joint='left_tip'/>")), HasSubstr("lead back to it"));
}

TEST_F(UrdfGripperOfAFile, TheCellHasItAndItGrips) {
  directory_.write("r.urdf", panda_like());
  // A cube of 40 mm.
  directory_.write(
      "cube.obj",
      "v -.02 -.02 -.02\nv .02 -.02 -.02\nv .02 .02 -.02\nv -.02 .02 -.02\nv -.02 -.02 .02\nv .02 -.02 .02\n"
      "v .02 .02 .02\nv -.02 .02 .02\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  directory_.write(
      "cell.yaml",
      "takt_scenario: 1\nname: fingers\nduration_s: 1\n"
      "parts:\n  Cube: {mesh: cube.obj, mass_kg: 0.1, hierarchy: 1, pose: {position_m: [0, 0, 0.0966], "
      "rpy_deg: [0, 0, "
      "45]}}\n"
      "grounds:\n  Table: {mesh: cube.obj, pose: {position_m: [0, 0, 0.0566]}}\n"
      "robots:\n  Robot: {urdf: r.urdf, base_link: base, flange_link: flange, initial_joints_rad: [0]}\n"
      "grippers:\n  Hand: {robot: Robot, fingers: auto}\n");
  for (const int level : {1, 2}) {
    const auto cell = load_cell(directory_ / "cell.yaml", {{}, level});
    for (const ImportNote& note : cell->import_notes)
      EXPECT_THAT(note.sentence, testing::Not(HasSubstr("stand still")));
    EXPECT_NEAR(cell->grippers[0].parameters.max_width_m, 0.081, 1e-12);
    EXPECT_EQ(cell->grippers[0].max_force_N, 20.0);
    for (const RobotLink& link : cell->description.robots[0].links)
      EXPECT_THAT(link.name, testing::AnyOf("base", "arm", "flange"));
    Simulation simulation(cell);
    std::vector<Command> commands{GripperCommand{0, {}, GripperAction::close, 0.0, 0.0}};
    for (int i = 0; i < 500; ++i) {
      ASSERT_TRUE(simulation.step(commands));
      commands.clear();
    }
    const Snapshot snapshot = simulation.make_snapshot();
    EXPECT_NEAR(snapshot.grippers[0].width_m, 0.04, 1e-4) << level;
    EXPECT_EQ(snapshot.grippers[0].part, cell->description.find_component("Cube")) << level;
  }
}

}  // namespace
}  // namespace takt
