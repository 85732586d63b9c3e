#include "server/scenario/urdf_arm.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <clocale>
#include <cmath>
#include <fstream>
#include <locale>

namespace takt {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class UrdfArmOfAFile : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("takt_urdf_" + std::to_string(getpid()) + ".urdf");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  UrdfArm read(const std::string& text, const std::string& base = "a", const std::string& flange = "c") {
    std::ofstream(path_) << text;
    return read_urdf_arm(path_, base, flange);
  }
  std::string error_of(const std::string& text, const std::string& base = "a",
                       const std::string& flange = "c") {
    testing::internal::CaptureStderr();
    std::string error = "no error";
    try {
      read(text, base, flange);
    } catch (const UrdfError& thrown) {
      error = thrown.what();
      EXPECT_THAT(error, HasSubstr(path_.string()));
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    return error;
  }

  std::filesystem::path path_;
};

std::string link(const std::string& name) {
  return "<link name='" + name + "'/>\n";
}

std::string joint(
    const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
    const std::string& inside = "<limit lower='-1' upper='1' velocity='2' effort='3'/><axis xyz='0 0 1'/>") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
         child + "'/>" + inside + "</joint>\n";
}

std::string robot(const std::string& inside) {
  return "<robot name='test'>\n" + inside + "</robot>\n";
}

std::string two_joints(const std::string& second) {
  return robot(link("a") + link("b") + link("c") + joint("j1", "revolute", "a", "b") + second);
}

TEST_F(UrdfArmOfAFile, ReadsExactFiguresInAnyLocale) {
  const std::string text =
      two_joints(joint("j2", "prismatic", "b", "c",
                       "<origin xyz='0.1 -0.57155 1e-3' rpy='0 0 0'/><axis xyz='0 3 4'/>"
                       "<limit lower='-0.30000000000000004' upper='0.123456789012345678' "
                       "velocity='2.0943951023931953' effort='7'/>"));
  const char* const before = std::setlocale(LC_ALL, nullptr);
  const std::string saved = before;
  // Available locales with decimal commas; a machine without one is no failure of the reader.
  for (const char* name : {"C", "de_DE.UTF-8", "fr_FR.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    const ArmModel arm = read(text).arm;
    ASSERT_EQ(arm.joint_count(), 2);
    EXPECT_EQ(arm.joints[0].name, "j1");
    EXPECT_EQ(arm.joints[1].type, JointType::prismatic);
    EXPECT_EQ(arm.joints[1].X_PJ.p, Vec3(0.1, -0.57155, 1e-3));
    EXPECT_EQ(arm.joints[1].X_PJ.R, Mat3::Identity());
    EXPECT_EQ(arm.joints[1].axis, Vec3(0.0, 3.0, 4.0).normalized());
    EXPECT_EQ(arm.joints[1].lower, -0.30000000000000004);
    EXPECT_EQ(arm.joints[1].upper, 0.123456789012345678);
    EXPECT_EQ(arm.joints[1].max_velocity, 2.0943951023931953);
    EXPECT_EQ(arm.joints[1].max_effort, 7.0);
  }
  std::setlocale(LC_ALL, saved.c_str());
  EXPECT_EQ(read(text).robot.text, text);
}

/// Digits grouped and a decimal comma, as a C++ program may have set for itself.
struct CommaPunctuation : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST_F(UrdfArmOfAFile, IgnoresTheGlobalLocaleOfTheProgram) {
  const std::string text = two_joints(joint("j2", "revolute", "b", "c"));
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new CommaPunctuation));
  const ArmModel arm = read(text).arm;
  const std::string error = error_of(
      two_joints(joint("j2", "revolute", "b", "c",
                       "<limit lower='1234.5' upper='1' velocity='2' effort='3'/><axis xyz='0 0 1'/>")));
  std::locale::global(before);
  EXPECT_EQ(arm.joints[1].upper, 1.0);
  EXPECT_THAT(error, HasSubstr("found lower 1234.5, upper 1; lower must be below upper"));
}

TEST_F(UrdfArmOfAFile, FoldsFixedJoints) {
  const std::string origin = "<origin xyz='0 0 1' rpy='0 0 1.5707963267948966'/>";
  const ArmModel arm =
      read(robot(link("a") + link("m") + link("b") + link("c") + link("camera") +
                 joint("f1", "fixed", "a", "m", origin) +
                 joint("j1", "continuous", "m", "b",
                       origin + "<axis xyz='1 0 0'/><limit velocity='1' effort='1'/>") +
                 joint("f2", "fixed", "b", "c", origin) + joint("f3", "fixed", "b", "camera", origin)))
          .arm;
  ASSERT_EQ(arm.joint_count(), 1);
  EXPECT_LT((arm.joints[0].X_PJ.p - Vec3(0.0, 0.0, 2.0)).norm(), 1e-15);
  EXPECT_LT((arm.joints[0].X_PJ.R - rotation_from_rpy({0.0, 0.0, M_PI})).norm(), 1e-15);
  EXPECT_LT((arm.X_JF.R - rotation_from_rpy({0.0, 0.0, M_PI / 2.0})).norm(), 1e-15);
  EXPECT_EQ(arm.joints[0].lower, -2.0 * M_PI);
  EXPECT_EQ(arm.joints[0].upper, 2.0 * M_PI);
}

TEST_F(UrdfArmOfAFile, RefusesBadFiles) {
  try {
    read_urdf_arm("no/such/file.urdf", "a", "b");
    FAIL() << "not refused";
  } catch (const UrdfError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no/such/file.urdf: there is no such file"));
  }
  EXPECT_THAT(error_of("<robot name='x'>\n<link name='a'>\n</robot>"),
              HasSubstr("line 2: not well-formed XML: mismatched element"));
  EXPECT_THAT(error_of(""), HasSubstr("not well-formed XML"));
  std::string deep = "<robot name='x'>\n";
  for (int i = 0; i < 200000; ++i) deep += "<a b='>'>";
  EXPECT_THAT(error_of(deep), HasSubstr("line 2: elements are nested deeper than "));
  std::string wide;
  for (int i = 0; i < 1000; ++i) wide += "<!-- <a> --><gazebo note=\"/\"/>\n";
  EXPECT_EQ(read(two_joints(joint("j2", "revolute", "b", "c") + wide)).arm.joint_count(), 2);
  EXPECT_THAT(error_of("<scene/>"), HasSubstr("found <scene> as the root element; allowed: <robot>"));
  EXPECT_THAT(error_of(robot("")), HasSubstr("line 1: <robot>: found no <link>"));
}

TEST_F(UrdfArmOfAFile, FindsTheChainByTheTree) {
  const std::string good = joint("j2", "revolute", "b", "c");
  const auto ends = [&](const std::string& joints, const std::string& links) {
    const UrdfArm arm = read(two_joints(joints + links), "", "");
    EXPECT_THAT(arm.remarks, Contains(HasSubstr("the arm is the chain from 'a' to '" + arm.flange_link +
                                                "', by the tree of the file")));
    return arm.base_link + " " + arm.flange_link + " " + std::to_string(arm.arm.joint_count());
  };
  EXPECT_EQ(ends(good, ""), "a c 2");
  // A flange without a name of ROS, what is fixed to it, and what is fixed beside the arm.
  EXPECT_EQ(ends(good + joint("f", "fixed", "c", "d", "") + joint("g", "fixed", "a", "e", ""),
                 link("d") + link("e")),
            "a d 2");
  EXPECT_EQ(ends(good + joint("f", "fixed", "c", "d", "") + joint("g", "fixed", "c", "e", ""),
                 link("d") + link("e")),
            "a c 2");
  // Two fingers end the arm.
  EXPECT_EQ(ends(good + joint("f", "fixed", "c", "palm", "") + joint("l", "prismatic", "palm", "d") +
                     joint("r", "prismatic", "palm", "e"),
                 link("palm") + link("d") + link("e")),
            "a palm 2");
  // The names of ROS come first.
  const UrdfArm ros = read(two_joints(good + joint("f", "fixed", "b", "tool0", "") + link("tool0")), "", "");
  EXPECT_EQ(ros.flange_link, "tool0");
  EXPECT_EQ(ros.arm.joint_count(), 1);
  EXPECT_THAT(
      error_of(robot(link("a") + link("b") + link("c") + joint("j1", "revolute", "a", "b") +
                     joint("j2", "revolute", "a", "c")),
               "", ""),
      HasSubstr("link 'a' carries several chains of moving joints: j1, j2; the robot's keys base_link and "
                "flange_link name the ends of one. Links: a, b, c"));
}

TEST_F(UrdfArmOfAFile, RefusesBadChains) {
  const std::string good = joint("j2", "revolute", "b", "c");
  EXPECT_THAT(error_of(two_joints(good), "base", "c"),
              HasSubstr("key base_link: found 'base', which is no link of this file; allowed: a, b, c"));
  EXPECT_THAT(error_of(two_joints(good), "a", "tool"), HasSubstr("key flange_link: found 'tool'"));
  EXPECT_THAT(error_of(two_joints(good), "c", "a"), HasSubstr("link 'a' is not below link 'c'"));
  EXPECT_THAT(error_of(two_joints(good), "a", "a"), HasSubstr("has no moving joint"));
  EXPECT_THAT(error_of(two_joints(good + joint("j3", "fixed", "a", "c", ""))),
              AllOf(HasSubstr("link 'c' is the child of two joints"), HasSubstr("'j2' and 'j3'")));
  EXPECT_THAT(error_of(two_joints(good + joint("j3", "fixed", "c", "a", ""))),
              HasSubstr("the joints above link 'a' lead back to it, by joint 'j3'"));
  EXPECT_THAT(error_of(two_joints(joint("j2", "revolute", "b", "missing"))),
              HasSubstr("line 6: joint 'j2' (revolute): <child>: link: found 'missing'"));
  std::string links = link("l0"), joints;
  for (int i = 1; i <= kMaxJoints + 1; ++i) {
    links += link("l" + std::to_string(i));
    joints +=
        joint("j" + std::to_string(i), "revolute", "l" + std::to_string(i - 1), "l" + std::to_string(i));
  }
  EXPECT_THAT(error_of(robot(links + joints), "l0", "l17"),
              HasSubstr("joint 'j17' (revolute) is moving joint number 17"));
  EXPECT_EQ(read(robot(links + joints.substr(0, joints.find("<joint name='j17'")) +
                       joint("j17", "fixed", "l16", "l17", "")),
                 "l0", "l17")
                .arm.joint_count(),
            16);
}

TEST_F(UrdfArmOfAFile, JointsBesideTheChainStandStill) {
  const auto limit = [](double lower, double upper) {
    return "<axis xyz='0 1 0'/><limit lower='" + std::to_string(lower) + "' upper='" + std::to_string(upper) +
           "' velocity='1' effort='1'/>";
  };
  const UrdfArm arm = read(robot(
      link("a") + link("b") + link("c") + link("finger") + link("tip") + link("thumb") + link("far") +
      joint("j1", "revolute", "a", "b") + joint("j2", "revolute", "b", "c") +
      joint("grip", "prismatic", "c", "finger", "<origin xyz='0 0 1'/>" + limit(0.02, 0.04)) +
      joint("bend", "revolute", "finger", "tip",
            limit(-1.0, 1.0) + "<mimic joint='grip' multiplier='2' "
                               "offset='0.1'/>") +
      joint("follow", "prismatic", "c", "thumb", limit(0.0, 1.0) + "<mimic joint='bend' multiplier='-1'/>") +
      joint("wheel", "continuous", "c", "far", "<axis xyz='1 0 0'/>")));
  EXPECT_EQ(arm.arm.joint_count(), 2);
  EXPECT_THAT(arm.standing_joints, testing::ElementsAre("grip", "bend", "follow", "wheel"));
  const auto pose = [&](const std::string& name) {
    for (const RobotLink& one : arm.links) {
      if (one.name != name) continue;
      EXPECT_EQ(one.joint, 1) << name;
      return one.X_JL;
    }
    ADD_FAILURE() << name;
    return Pose{};
  };
  EXPECT_LT((pose("finger").p - Vec3(0.0, 0.02, 1.0)).norm(), 1e-15);
  const double bent = 2.0 * 0.02 + 0.1;
  EXPECT_LT((pose("tip").R - Eigen::AngleAxisd(bent, Vec3::UnitY()).toRotationMatrix()).norm(), 1e-15);
  EXPECT_LT((pose("thumb").p - Vec3(0.0, -bent, 0.0)).norm(), 1e-15);
  EXPECT_EQ(pose("far"), Pose{});
}

TEST_F(UrdfArmOfAFile, ARevoluteJointWithoutARangeTurnsOnceToEachSideWithARemark) {
  const std::string inside = "<axis xyz='0 0 1'/><limit lower='0' upper='0' velocity='2' effort='3'/>";
  const UrdfArm arm = read(two_joints(joint("j2", "revolute", "b", "c", inside)));
  EXPECT_EQ(arm.arm.joints[1].lower, -2.0 * M_PI);
  EXPECT_EQ(arm.arm.joints[1].upper, 2.0 * M_PI);
  ASSERT_EQ(arm.remarks.size(), 1U);
  EXPECT_THAT(arm.remarks[0], HasSubstr("joint 'j2' (revolute): lower and upper are 0"));
  EXPECT_THROW(read(two_joints(joint("j2", "prismatic", "b", "c", inside))), std::exception);
}

TEST_F(UrdfArmOfAFile, LimitsThatAreNotStatedAreAssumedWithARemark) {
  const std::string axis = "<axis xyz='0 0 1'/>", range = "<limit lower='-1' upper='1' ";
  for (const auto& [type, inside] :
       {std::pair<std::string, std::string>{"continuous",
                                            ""},             // needs no <limit>: wiki.ros.org/urdf/XML/joint
        {"continuous", "<limit effort='0' velocity='0'/>"},  // as exporters of CAD programs write it
        {"revolute", range + "velocity='0' effort='0'/>"},
        {"revolute", range + "velocity='-1' effort='-1'/>"},
        {"revolute", range + "effort='0'/>"},
        {"prismatic", range + "/>"}}) {
    const UrdfArm arm = read(two_joints(joint("j2", type, "b", "c", axis + inside)));
    const bool slides = type == "prismatic";
    EXPECT_EQ(arm.arm.joints[1].max_velocity, slides ? 1.0 : M_PI) << inside;
    EXPECT_EQ(arm.arm.joints[1].max_effort, 0.0) << inside;
    ASSERT_EQ(arm.remarks.size(), 1U) << inside;
    EXPECT_THAT(arm.remarks[0],
                AllOf(HasSubstr("line 6: joint 'j2' (" + type + "): the file states no velocity"),
                      HasSubstr(slides ? "1 m/s" : "pi rad/s")));
  }
  EXPECT_THAT(read(two_joints(joint("j2", "revolute", "b", "c"))).remarks, testing::IsEmpty());
}

TEST_F(UrdfArmOfAFile, AWorldThatIsElsewhereIsRemarked) {
  const auto standing = [&](const std::string& origin) {
    return robot(link("world") + link("table") + link("a") + link("b") +
                 joint("w", "fixed", "world", "table", origin) +
                 joint("t", "fixed", "table", "a", "<origin xyz='0 0 0.5'/>") +
                 joint("j1", "revolute", "a", "b"));
  };
  const UrdfArm arm = read(standing("<origin xyz='1 2 0' rpy='0 0 1.5707963267948966'/>"), "a", "b");
  ASSERT_EQ(arm.remarks.size(), 1U);
  EXPECT_THAT(arm.remarks[0], AllOf(HasSubstr("places link 'a' at (1, 2, 0.5) m in its link 'world'"),
                                    HasSubstr("base_link: world")));
  EXPECT_THAT(read(standing("<origin xyz='0 0 -0.5'/>"), "a", "b").remarks, testing::IsEmpty());
  // By its link `world` the arm stands where the file has it.
  const UrdfArm kept = read(standing("<origin xyz='1 2 0'/>"), "world", "b");
  EXPECT_THAT(kept.remarks, testing::IsEmpty());
  EXPECT_LT((kept.arm.joints[0].X_PJ.p - Vec3(1.0, 2.0, 0.5)).norm(), 1e-15);
}

TEST_F(UrdfArmOfAFile, NamesOtherFormats) {
  EXPECT_THAT(error_of("<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'>\n<link name='a'/>\n"
                       "<xacro:include filename='x.xacro'/></robot>"),
              AllOf(HasSubstr("line 3: found <xacro:include>: the file is a xacro"),
                    HasSubstr("'xacro " + path_.string() + " > ")));
  // As ROS packages have it: the command states the arguments that the file asks for.
  const std::filesystem::path macros = path_.parent_path() / "arm.urdf.xacro";
  std::ofstream(macros)
      << "<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'>\n<xacro:arg name='type'/>\n"
         "<xacro:arg name='prefix' default=''/><xacro:arm/></robot>";
  try {
    read_urdf(macros);
    ADD_FAILURE() << "no error";
  } catch (const UrdfError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'xacro " + macros.string() + " type:=VALUE > " +
                                        (path_.parent_path() / "arm.urdf").string() + "' writes it"));
  }
  std::filesystem::remove(macros);
  EXPECT_THAT(error_of("<robot name='r'><link name='a'><xacro:if value='1'/></link></robot>"),
              HasSubstr("<xacro:if>"));
  EXPECT_THAT(error_of("<sdf version='1.9'><model name='m'/></sdf>"),
              HasSubstr("line 1: found <sdf>: an SDFormat file"));
  EXPECT_THAT(error_of("<mujoco/>"), HasSubstr("found <mujoco> as the root element; allowed: <robot>"));
}

TEST_F(UrdfArmOfAFile, RefusesBadJoints) {
  const auto error = [this](const std::string& type, const std::string& inside) {
    return error_of(two_joints(joint("j2", type, "b", "c", inside)));
  };
  const std::string axis = "<axis xyz='0 0 1'/>";
  const std::string limit = "<limit lower='-1' upper='1' velocity='2' effort='3'/>";
  EXPECT_THAT(error("floating", ""), HasSubstr("line 6: joint 'j2' (floating): the type is not allowed"));
  EXPECT_THAT(error("planar", axis), HasSubstr("joint 'j2' (planar): the type is not allowed"));
  EXPECT_THAT(error("hinge", axis + limit), AllOf(HasSubstr("j2"), HasSubstr("hinge")));
  EXPECT_THAT(error("revolute", axis), AllOf(HasSubstr("joint 'j2'"), HasSubstr("found no <limit>")));
  EXPECT_THAT(error("revolute", limit + "<axis xyz='0 0 0'/>"),
              HasSubstr("<axis>: xyz: found (0, 0, 0); allowed: a vector with a direction"));
  EXPECT_THAT(error("revolute", axis + "<limit lower='1' upper='1' velocity='2' effort='3'/>"),
              AllOf(HasSubstr("line 6: joint 'j2' (revolute): <limit>: found lower 1, upper 1"),
                    HasSubstr("lower must be below upper")));
  EXPECT_THAT(error("revolute", axis + limit + "<mimic joint='j1'/>"),
              AllOf(HasSubstr("it mimics joint 'j1'; joints of an arm move on their own"),
                    HasSubstr("flange_link: b ends the arm before it")));
  for (const char* bad : {"nan", "inf", "1e999", "1,5", "x"}) {
    EXPECT_THAT(error("revolute",
                      axis + "<limit lower='-1' upper='" + std::string(bad) + "' velocity='2' effort='3'/>"),
                HasSubstr(std::string(bad)));
    EXPECT_THAT(error("revolute", axis + limit + "<origin xyz='0 0 " + std::string(bad) + "'/>"),
                HasSubstr("j2"));
  }
}

TEST_F(UrdfArmOfAFile, RefusesWhatIsNotUrdf) {
  const std::string arm = joint("j1", "revolute", "a", "b") + joint("j2", "revolute", "b", "c");
  const auto with = [&](const std::string& inside) {
    return robot(link("a") + link("b") + link("c") + arm + inside);
  };
  EXPECT_EQ(error_of(with("")), "no error");
  EXPECT_THAT(error_of("<robot>" + link("a") + "</robot>"),
              HasSubstr("line 1: <robot>: name: found nothing"));
  EXPECT_THAT(error_of("<robot name='x' version='2.0'/>"), HasSubstr("version: found '2.0'; allowed: 1.0"));
  EXPECT_THAT(error_of(with("<link/>")), HasSubstr("line 7: <link>: name: found nothing"));
  EXPECT_THAT(error_of(with(link("b"))), HasSubstr("line 7: link 'b': found a second one"));
  EXPECT_THAT(error_of(with(joint("j1", "fixed", "a", "b"))),
              HasSubstr("line 7: joint 'j1': found a second one"));
  EXPECT_THAT(error_of(with(link("d"))), HasSubstr("line 7: no joint carries link 'a', and none link 'd'"));
  EXPECT_THAT(error_of(with(link("d") + joint("j3", "fixed", "d", "d"))),
              HasSubstr("line 8: the joints above link 'd' lead back to it, by joint 'j3'"));
  EXPECT_THAT(error_of(with("<joint name='j3' type='fixed'><child link='a'/></joint>")),
              HasSubstr("line 7: joint 'j3' (fixed): found no <parent>"));
  EXPECT_THAT(error_of(with("<joint name='j3'/>")), HasSubstr("line 7: joint 'j3': type: found nothing"));
  EXPECT_THAT(error_of(with("<link name='d' name='e'/>")), HasSubstr("line 7: not well-formed XML"));
  EXPECT_THAT(error_of(with("<link name='&#xD800;'/>")),
              AllOf(HasSubstr("line 7: name: found '"), HasSubstr("allowed: UTF-8")));
  EXPECT_THAT(error_of(with("\n<link name='\xC3\xA4\xC3'/>")),
              HasSubstr("line 8: found a byte that is not UTF-8"));
  EXPECT_THAT(error_of(with(std::string("\0", 1))),
              HasSubstr("line 7: found a byte that is not UTF-8, or zero"));

  const auto link_error = [&](const std::string& inside) {
    return error_of(with("<link name='d'>\n" + inside + "</link>"));
  };
  EXPECT_THAT(link_error("<visual><geometry/></visual>"),
              HasSubstr("line 8: link 'd': <visual>: found no geometry; allowed: <geometry> with box"));
  EXPECT_THAT(link_error("<collision><geometry><cone/></geometry></collision>"),
              HasSubstr("link 'd': <collision>: found <cone>; allowed: box, cylinder, sphere, mesh"));
  EXPECT_THAT(link_error("<collision><geometry><mesh/></geometry></collision>"),
              HasSubstr("<mesh>: filename: found nothing"));
  EXPECT_THAT(link_error("<visual><geometry><box size='1 2'/></geometry></visual>"),
              HasSubstr("<box>: size: found '1 2'; allowed: 3 finite numbers"));
  EXPECT_THAT(
      link_error(
          "<inertial><mass value='1'/>\n<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0'/></inertial>"),
      HasSubstr("line 9: link 'd': <inertial>: <inertia>: iyz: found ''; allowed: a finite number"));
  EXPECT_THAT(link_error("<inertial><mass value='1'/></inertial>"),
              HasSubstr("found no <inertia>, which is needed"));
  for (const char* bad : {"1 2 3 4", "1.5.2 3", "1-2 3", "0x1 0 0", "1 2 3;", ""})
    EXPECT_THAT(error_of(with(joint("j3", "fixed", "a", "b", "<origin xyz='" + std::string(bad) + "'/>"))),
                HasSubstr("<origin>: xyz: found '" + std::string(bad) + "'; allowed: 3 finite numbers"));
}

TEST_F(UrdfArmOfAFile, ReadsNumbersBetweenAnyWhiteSpace) {
  const ArmModel arm = read(two_joints(joint("j2", "revolute", "b", "c",
                                             "<origin xyz=' +1\t2e0\n 3.0  '/><axis xyz='0 0 1'/>"
                                             "<limit lower=' -1 ' upper='1' velocity='2' effort='3'/>")))
                           .arm;
  EXPECT_EQ(arm.joints[1].X_PJ.p, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(arm.joints[1].lower, -1.0);
}

}  // namespace
}  // namespace takt
