// <inertial> of the links of an arm: all links fixed to a joint as one body, and errors with their place.
#include "server/scenario/urdf_arm.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <optional>

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kLimit = "<limit lower='-1' upper='2' velocity='3' effort='4'/>";

std::string link_with(const std::string& name, const std::string& inside = "") {
  return "<link name='" + name + "'>" + inside + "</link>\n";
}

std::string inertial(const std::string& mass, const std::string& tensor, const std::string& origin = "") {
  return "<inertial>" + origin + "<mass value='" + mass + "'/><inertia " + tensor + "/></inertial>";
}

std::string body(double mass = 2.0) {
  return inertial(std::to_string(mass), "ixx='0.1' iyy='0.2' izz='0.2' ixy='0' ixz='0' iyz='0'");
}

std::string joint_with(const std::string& name, const std::string& type, const std::string& parent,
                       const std::string& child, const std::string& inside = kLimit) {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
         child + "'/>" + inside + "</joint>\n";
}

class UrdfInertiasOfAnArm : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("takt_inertias_" + std::to_string(getpid()) + ".urdf");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  UrdfArm arm(const std::string& inside, const std::string& flange = "arm") {
    std::ofstream(path_) << "<robot name='test'>\n" + inside + "</robot>\n";
    return read_urdf_arm(path_, "base", flange);
  }
  std::string error_of(const std::string& inside, std::optional<double> mass_kg = std::nullopt) {
    try {
      urdf_inertias(arm(inside), mass_kg);
    } catch (const UrdfError& thrown) {
      EXPECT_THAT(thrown.what(), HasSubstr(path_.string()));
      return thrown.what();
    }
    return "no error";
  }

  std::filesystem::path path_;
};

TEST_F(UrdfInertiasOfAnArm, FixedLinksMoveAsOneBody) {
  const std::string half_turn = "<origin xyz='0 0 1' rpy='0 0 3.141592653589793'/>";
  const UrdfArm file = arm(link_with("world") + link_with("base", body()) + link_with("arm", body()) +
                               link_with("hand", body(1.0)) + link_with("finger", body()) +
                               link_with("lamp") + joint_with("j_lamp", "fixed", "world", "lamp", "") +
                               joint_with("j_base", "fixed", "world", "base", "<origin xyz='0 0 2'/>") +
                               joint_with("j_arm", "revolute", "base", "arm",
                                          "<origin xyz='1 0 0'/><axis xyz='0 0 2'/>" + kLimit) +
                               joint_with("j_hand", "fixed", "arm", "hand", half_turn) +
                               joint_with("j_finger", "prismatic", "hand", "finger",
                                          "<origin xyz='0.5 0 0'/><axis xyz='0 1 0'/>" + kLimit),
                           "finger");
  ASSERT_EQ(file.arm.joint_count(), 2);
  const JointModel& first = file.arm.joints[0];
  EXPECT_EQ(first.name, "j_arm");
  EXPECT_EQ(first.axis, Vec3::UnitZ());
  EXPECT_EQ(first.lower, -1.0);
  EXPECT_EQ(first.max_velocity, 3.0);
  EXPECT_EQ(first.max_effort, 4.0);
  // The finger hangs on the hand, which is turned by half a turn.
  EXPECT_LT((file.arm.joints[1].X_PJ.p - Vec3(-0.5, 0.0, 1.0)).norm(), 1e-15);
  EXPECT_EQ(file.arm.joints[1].type, JointType::prismatic);
  const std::vector<BodyInertia> inertias = urdf_inertias(file).links;
  ASSERT_EQ(inertias.size(), 2u);
  // Arm and hand as one: 3 kg, the hand a metre above.
  EXPECT_DOUBLE_EQ(inertias[0].mass_kg, 3.0);
  EXPECT_NEAR(inertias[0].p_BBcm_B.z(), 1.0 / 3.0, 1e-15);
  EXPECT_NEAR(inertias[0].I_BBcm_B(0, 0), 0.2 + 2.0 / 3.0, 1e-14);
  EXPECT_NEAR(inertias[0].I_BBcm_B(2, 2), 0.4, 1e-14);
  EXPECT_DOUBLE_EQ(inertias[1].mass_kg, 2.0);
  // All links by name: those below the base first.
  ASSERT_EQ(file.links.size(), 6u);
  EXPECT_EQ(file.below_base.size(), 4u);
  const std::pair<const char*, int> expected[] = {{"base", -1},  {"arm", 0},    {"hand", 0},
                                                  {"finger", 1}, {"world", -1}, {"lamp", -1}};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(file.links[i].name, expected[i].first);
    EXPECT_EQ(file.links[i].joint, expected[i].second);
  }
  EXPECT_EQ(file.links[2].X_JL.p, Vec3(0.0, 0.0, 1.0));
  EXPECT_EQ(file.links[5].X_JL.p, Vec3(0.0, 0.0, -2.0));
}

TEST_F(UrdfInertiasOfAnArm, RefusesInertiasThatAreNot) {
  const auto with = [](const std::string& inside) {
    return link_with("base") + link_with("arm", inside) + joint_with("j", "revolute", "base", "arm");
  };
  const std::string good = "ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'";
  EXPECT_EQ(error_of(with(inertial("1", good))), "no error");
  EXPECT_THAT(error_of(with("")), AllOf(HasSubstr("line 3"), HasSubstr("link 'arm': found no <inertial>"),
                                        HasSubstr("joint 'j'")));
  EXPECT_EQ(arm(with("")).arm.joint_count(), 1);  // good enough for kinematics
  EXPECT_THAT(error_of(with(inertial("-1", good))),
              AllOf(HasSubstr("line 3"), HasSubstr("link 'arm': <inertial>: its mass is -1 kg")));
  EXPECT_THAT(error_of(with(inertial("0", good))), HasSubstr("an inertia tensor but no mass"));
  EXPECT_THAT(error_of(with(inertial("1", "ixx='1' iyy='-1' izz='1' ixy='0' ixz='0' iyz='0'"))),
              AllOf(HasSubstr("link 'arm'"), HasSubstr("(-1, 1, 1)"), HasSubstr("none may be negative")));
  EXPECT_THAT(error_of(with(inertial("1", "ixx='1' iyy='1' izz='1' ixy='2' ixz='0' iyz='0'"))),
              HasSubstr("none may be negative"));
  for (const char* bad : {"nan", "inf", "1e999", "x", "1 2", ""}) {
    EXPECT_THAT(error_of(with(inertial(bad, good))), HasSubstr("arm")) << bad;
    EXPECT_THAT(error_of(with(
                    inertial("1", "ixx='1' iyy='1' izz='" + std::string(bad) + "' ixy='0' ixz='0' iyz='0'"))),
                HasSubstr("arm"))
        << bad;
    EXPECT_NE(error_of(with(inertial("1", good, "<origin xyz='0 0 " + std::string(bad) + "'/>"))), "no error")
        << bad;
  }
  EXPECT_THAT(error_of(with("<inertial><mass value='1'/></inertial>")), HasSubstr("arm"));
  // A principal moment beyond the sum of the others is reported, not refused: published robots have it.
  const UrdfInertias odd =
      urdf_inertias(arm(with(inertial("1", "ixx='1' iyy='3' izz='1' ixy='0' ixz='0' iyz='0'"))));
  ASSERT_EQ(odd.remarks.size(), 1u);
  EXPECT_THAT(odd.remarks[0], AllOf(HasSubstr("line 3"), HasSubstr("link 'arm'"), HasSubstr("(1, 1, 3)")));
}

TEST_F(UrdfInertiasOfAnArm, RefusesMeshesThatAreNotThere) {
  const auto with = [](const std::string& file) {
    return link_with("base", "<visual><geometry><mesh filename='" + file + "'/></geometry></visual>") +
           link_with("arm", body()) + joint_with("j", "revolute", "base", "arm");
  };
  EXPECT_THAT(
      error_of(with("no_such_mesh.stl")),
      AllOf(HasSubstr("line 2"), HasSubstr("link 'base': <mesh>: filename: found 'no_such_mesh.stl'")));
  EXPECT_EQ(error_of(with(path_.filename().string())), "no error");
  EXPECT_EQ(error_of(with("file://" + path_.filename().string())), "no error");
  EXPECT_EQ(error_of(with("package://elsewhere/arm.stl")), "no error");
}

std::string box(const char* element, const std::string& size, const std::string& origin = "") {
  return "<" + std::string(element) + ">" + origin + "<geometry><box size='" + size + "'/></geometry></" +
         element + ">";
}

// 16 kg in shares of 2, 6 and 8 l: the base has 2 kg, the arm 6 kg in two boxes, the hand on it 8 kg.
TEST_F(UrdfInertiasOfAnArm, LinksWithoutInertialShareAMassByTheVolumeOfTheirShapes) {
  const std::string links = link_with("base", box("collision", "0.1 0.1 0.2")) +
                            link_with("arm", box("collision", "0.1 0.2 0.2", "<origin xyz='0 0 0.1'/>") +
                                                 box("collision", "0.1 0.1 0.2", "<origin xyz='0 0 0.3'/>") +
                                                 box("visual", "9 9 9")) +
                            link_with("hand", box("visual", "0.2 0.2 0.2")) + link_with("frame") +
                            joint_with("j", "revolute", "base", "arm") +
                            joint_with("j_hand", "fixed", "arm", "hand", "<origin xyz='0 0 0.5'/>") +
                            joint_with("j_frame", "fixed", "hand", "frame", "");
  const UrdfInertias inertias = urdf_inertias(arm(links), 16.0);
  ASSERT_EQ(inertias.links.size(), 1U);
  const BodyInertia& one = inertias.links[0];
  EXPECT_NEAR(one.mass_kg, 14.0, 1e-12);
  const double z = (4.0 * 0.1 + 2.0 * 0.3 + 8.0 * 0.5) / 14.0;
  EXPECT_LT((one.p_BBcm_B - Vec3(0.0, 0.0, z)).norm(), 1e-12);
  const auto square = [](double x) { return x * x; };
  const double about_x = 4.0 * (0.08 / 12.0 + square(z - 0.1)) + 2.0 * (0.05 / 12.0 + square(z - 0.3)) +
                         8.0 * (0.08 / 12.0 + square(z - 0.5));
  EXPECT_NEAR(one.I_BBcm_B(0, 0), about_x, 1e-12);
  EXPECT_NEAR(one.I_BBcm_B(2, 2), 4.0 * 0.05 / 12.0 + 2.0 * 0.02 / 12.0 + 8.0 * 0.08 / 12.0, 1e-12);
  ASSERT_EQ(inertias.remarks.size(), 1U);
  EXPECT_THAT(inertias.remarks[0], HasSubstr("at even density: base 2 kg, arm 6 kg, hand 8 kg"));
}

TEST_F(UrdfInertiasOfAnArm, LinksWithInertialKeepIt) {
  const std::string links =
      link_with("base", body(50.0)) + link_with("arm", body(3.0) + box("collision", "1 1 1")) +
      link_with("hand", box("collision", "0.1 0.1 0.1")) + joint_with("j", "revolute", "base", "arm") +
      joint_with("j_hand", "fixed", "arm", "hand", "");
  EXPECT_NEAR(urdf_inertias(arm(links), 2.0).links[0].mass_kg, 5.0, 1e-12);
}

TEST_F(UrdfInertiasOfAnArm, AMassWithoutTakersIsReported) {
  const std::string joint = joint_with("j", "revolute", "base", "arm");
  EXPECT_THAT(error_of(link_with("base", body()) + link_with("arm", body()) + joint, 2.0),
              AllOf(HasSubstr("found <inertial> in each link from 'base' on"), HasSubstr("mass_kg")));
  EXPECT_THAT(error_of(link_with("base", body()) + link_with("arm") + joint, 2.0),
              HasSubstr("found no <collision> or <visual> with a volume"));
  EXPECT_THAT(error_of(link_with("base", box("collision", "1 1 1")) + link_with("arm") + joint, 2.0),
              AllOf(HasSubstr("link 'arm': found no <inertial>"), HasSubstr("or shapes with a volume")));
  EXPECT_THAT(error_of(link_with("base") + link_with("arm") + joint), HasSubstr("the robot's key mass_kg"));
}

}  // namespace
}  // namespace takt
