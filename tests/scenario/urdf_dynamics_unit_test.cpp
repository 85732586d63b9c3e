#include "server/scenario/urdf_dynamics.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>

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

class UrdfDynamics : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("takt_dynamics_" + std::to_string(getpid()) + ".urdf");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  UrdfTree read(const std::string& inside, const UrdfTreeOptions& options = {}) {
    std::ofstream(path_) << "<robot name='test'>\n" + inside + "</robot>\n";
    return read_urdf_tree(path_, "base", options);
  }
  std::string error_of(const std::string& inside, const UrdfTreeOptions& options = {}) {
    try {
      read(inside, options);
    } catch (const UrdfError& thrown) {
      EXPECT_THAT(thrown.what(), HasSubstr(path_.string()));
      return thrown.what();
    }
    return "no error";
  }

  std::filesystem::path path_;
};

TEST_F(UrdfDynamics, ATreeWithBranchesFixedLinksAndMimicJointsIsRead) {
  const std::string half_turn = "<origin xyz='0 0 1' rpy='0 0 3.141592653589793'/>";
  const UrdfTree file = read(
      link_with("base", body()) + link_with("arm", body()) + link_with("hand", body(1.0)) +
      link_with("finger_1", body()) + link_with("finger_2", body()) + link_with("wheel", body()) +
      joint_with("j_arm", "revolute", "base", "arm", "<origin xyz='1 0 0'/><axis xyz='0 0 2'/>" + kLimit) +
      joint_with("j_hand", "fixed", "arm", "hand", half_turn) +
      joint_with("j_1", "prismatic", "hand", "finger_1",
                 "<origin xyz='0.5 0 0'/><axis xyz='0 1 0'/>" + kLimit) +
      joint_with("j_2", "prismatic", "hand", "finger_2",
                 "<axis xyz='0 -1 0'/><mimic joint='j_1' multiplier='-2' offset='0.1'/>" + kLimit) +
      joint_with("j_wheel", "continuous", "base", "wheel", ""));
  ASSERT_EQ(file.tree.joint_count(), 4);
  const auto& joints = file.tree.joints;
  EXPECT_EQ(joints[0].joint.name, "j_arm");
  EXPECT_EQ(joints[0].joint.axis, Vec3::UnitZ());
  EXPECT_EQ(joints[0].joint.lower, -1.0);
  EXPECT_EQ(joints[0].joint.max_velocity, 3.0);
  EXPECT_EQ(joints[0].joint.max_effort, 4.0);
  EXPECT_EQ(joints[0].parent, -1);
  // Arm and hand as one: 3 kg, the hand a metre above.
  EXPECT_DOUBLE_EQ(joints[0].inertia.mass_kg, 3.0);
  EXPECT_NEAR(joints[0].inertia.p_BBcm_B.z(), 1.0 / 3.0, 1e-15);
  EXPECT_NEAR(joints[0].inertia.I_BBcm_B(0, 0), 0.2 + 2.0 / 3.0, 1e-14);
  EXPECT_NEAR(joints[0].inertia.I_BBcm_B(2, 2), 0.4, 1e-14);
  // The fingers hang on the hand, which is turned by half a turn.
  EXPECT_EQ(joints[1].parent, 0);
  EXPECT_EQ(joints[2].parent, 0);
  EXPECT_LT((joints[1].joint.X_PJ.p - Vec3(-0.5, 0.0, 1.0)).norm(), 1e-15);
  EXPECT_EQ(joints[1].joint.type, JointType::prismatic);
  EXPECT_EQ(joints[3].joint.name, "j_wheel");
  EXPECT_EQ(joints[3].joint.axis, Vec3::UnitX());
  EXPECT_TRUE(std::isinf(joints[3].joint.upper) && std::isinf(joints[3].joint.max_effort));
  ASSERT_EQ(file.mimics.size(), 1u);
  EXPECT_EQ(file.mimics[0].joint, 2);
  EXPECT_EQ(file.mimics[0].source, 1);
  EXPECT_EQ(file.mimics[0].multiplier, -2.0);
  EXPECT_EQ(file.mimics[0].offset, 0.1);
  ASSERT_EQ(file.frames.size(), 6u);
  EXPECT_EQ(file.frames[2].link, "hand");
  EXPECT_EQ(file.frames[2].joint, 0);
  EXPECT_EQ(file.frames[2].X_JL.p, Vec3(0.0, 0.0, 1.0));
  EXPECT_EQ(MultibodyTree(file.tree).joint_count(), 4);
}

TEST_F(UrdfDynamics, ImpossibleInertiasAreRefused) {
  const auto with = [](const std::string& inside) {
    return link_with("base") + link_with("arm", inside) + joint_with("j", "revolute", "base", "arm");
  };
  const std::string good = "ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'";
  EXPECT_EQ(error_of(with(inertial("1", good))), "no error");
  EXPECT_THAT(error_of(with("")), AllOf(HasSubstr("line 3"), HasSubstr("link 'arm': found no <inertial>"),
                                        HasSubstr("joint 'j'")));
  EXPECT_EQ(read(with(""), {false, false}).tree.joints[0].inertia.mass_kg, 0.0);
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
  // A principal moment beyond the sum of the others is told, not refused: published robots have it.
  const UrdfTree odd = read(with(inertial("1", "ixx='1' iyy='3' izz='1' ixy='0' ixz='0' iyz='0'")));
  ASSERT_EQ(odd.remarks.size(), 1u);
  EXPECT_THAT(odd.remarks[0], AllOf(HasSubstr("line 3"), HasSubstr("link 'arm'"), HasSubstr("(1, 1, 3)")));
}

TEST_F(UrdfDynamics, InvalidTreesAreRefused) {
  const std::string links = link_with("base") + link_with("a", body()) + link_with("b", body());
  const std::string first = joint_with("j1", "revolute", "base", "a");
  EXPECT_THAT(error_of(links + first + joint_with("j2", "revolute", "a", "b") +
                       joint_with("j3", "revolute", "base", "b")),
              AllOf(HasSubstr("link 'b' is the child of two joints"), HasSubstr("'j2' and 'j3'")));
  EXPECT_THAT(error_of(links + first + joint_with("j2", "revolute", "a", "base")),
              HasSubstr("lead back to it"));
  EXPECT_THAT(
      error_of(link_with("root", body()) + joint_with("j", "revolute", "root", "x") + link_with("x", body())),
      HasSubstr("there is no link 'base'; the file has the links root, x"));
  EXPECT_THAT(error_of(links + first + joint_with("j2", "floating", "a", "b", "")),
              AllOf(HasSubstr("line 6"), HasSubstr("joint 'j2' (floating): the type is not allowed")));
  EXPECT_THAT(
      error_of(links + first + joint_with("j2", "revolute", "a", "b", "<axis xyz='0 0 0'/>" + kLimit)),
      AllOf(HasSubstr("joint 'j2'"), HasSubstr("a vector with a direction")));
  EXPECT_THAT(error_of(links + first + joint_with("j2", "revolute", "a", "b", "")),
              AllOf(HasSubstr("j2"), HasSubstr("limit")));
  const std::string endless = links + first + joint_with("j2", "continuous", "a", "b", "");
  EXPECT_EQ(error_of(endless), "no error");
  EXPECT_THAT(error_of(endless, {true, true}),
              AllOf(HasSubstr("line 6"), HasSubstr("joint 'j2' (continuous): it turns without end")));
  const auto mimic = [&](const std::string& source) {
    return links + joint_with("j1", "revolute", "base", "a", kLimit + "<mimic joint='" + source + "'/>") +
           joint_with("j2", "revolute", "a", "b", kLimit + "<mimic joint='j1'/>");
  };
  EXPECT_THAT(error_of(mimic("j9")), AllOf(HasSubstr("joint 'j1': <mimic>"), HasSubstr("'j9'")));
  EXPECT_THAT(error_of(mimic("j1")), HasSubstr("lead back to it"));
  EXPECT_THAT(error_of(mimic("j2")), HasSubstr("lead back to it"));
  // A mimic of a mimic is none of itself.
  EXPECT_EQ(error_of(links + link_with("c", body()) + first +
                     joint_with("j2", "revolute", "a", "b", kLimit + "<mimic joint='j1'/>") +
                     joint_with("j3", "revolute", "b", "c", kLimit + "<mimic joint='j2'/>")),
            "no error");
  std::string many = link_with("base");
  for (int i = 0; i <= kMaxJoints; ++i) {
    const std::string n = std::to_string(i + 1);
    many += link_with("l" + n, body()) + joint_with("j" + n, "revolute", "base", "l" + n);
  }
  EXPECT_THAT(error_of(many), HasSubstr("joint 'j17' (revolute): it is moving joint number 17"));
}

TEST_F(UrdfDynamics, EmptyRangesOfLimitsAreRefused) {
  const auto with = [](const std::string& limits) {
    return link_with("base") + link_with("arm", body()) +
           joint_with("j", "revolute", "base", "arm", "<limit " + limits + "/>");
  };
  EXPECT_THAT(
      error_of(with("lower='1' upper='1' velocity='1' effort='1'")),
      AllOf(HasSubstr("line 4"), HasSubstr("joint 'j' (revolute): <limit>: found lower '1', upper '1'"),
            HasSubstr("lower must be below upper")));
  EXPECT_THAT(error_of(with("lower='-1' upper='1' velocity='0' effort='1'")),
              AllOf(HasSubstr("velocity: found '0'"), HasSubstr("allowed: > 0")));
  EXPECT_THAT(error_of(with("lower='-1' upper='1' velocity='1' effort='-1'")),
              AllOf(HasSubstr("effort: found '-1'"), HasSubstr("allowed: >= 0")));
  EXPECT_EQ(error_of(with("lower='-1' upper='1' velocity='1' effort='0'")), "no error");
}

TEST_F(UrdfDynamics, MissingMeshesAreRefused) {
  const auto with = [](const std::string& file) {
    return link_with("base", "<visual><geometry><mesh filename='" + file + "'/></geometry></visual>");
  };
  EXPECT_THAT(
      error_of(with("no_such_mesh.stl")),
      AllOf(HasSubstr("line 2"), HasSubstr("link 'base': <mesh>: filename: found 'no_such_mesh.stl'")));
  EXPECT_EQ(error_of(with(path_.filename().string())), "no error");
  EXPECT_EQ(error_of(with("package://elsewhere/arm.stl")), "no error");
}

/// What a MultibodyTree says of a model, of which one thing is made wrong.
std::string tree_error(const std::function<void(TreeModel&)>& change) {
  TreeModel model;
  for (int i = 0; i < 2; ++i) {
    TreeJoint joint;
    joint.joint.name = i == 0 ? "first" : "second";
    joint.parent = i - 1;
    joint.inertia = {1.0, Vec3(0.1, 0.0, 0.0), 0.01 * Mat3::Identity()};
    model.joints.push_back(joint);
  }
  change(model);
  try {
    const MultibodyTree tree(model);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(MultibodyTreeModel, UnphysicalModelsAreRefused) {
  const auto second = [](TreeModel& model) -> TreeJoint& { return model.joints[1]; };
  EXPECT_EQ(tree_error([](TreeModel&) {}), "no error");
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).parent = 1; }),
              AllOf(HasSubstr("joint 'second' (number 2)"), HasSubstr("parent")));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.mass_kg = -1.0; }),
              AllOf(HasSubstr("'second'"), HasSubstr("mass is -1 kg")));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.I_BBcm_B(0, 0) = -1.0; }),
              HasSubstr("none may be negative"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.I_BBcm_B(0, 1) = 0.005; }),
              HasSubstr("not symmetric"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.I_BBcm_B(2, 2) = std::nan(""); }),
              HasSubstr("tensor is not finite"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.p_BBcm_B.x() = std::nan(""); }),
              HasSubstr("centre of mass is not finite"));
  EXPECT_THAT(tree_error([&](TreeModel& m) {
                second(m).joint.axis = {0.0, 0.0, 2.0};
              }),
              HasSubstr("not a unit vector"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).armature = -0.1; }), HasSubstr("its drive is -0.1"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia = {}; }),
              AllOf(HasSubstr("'second'"), HasSubstr("nothing resists its motion")));
  EXPECT_THAT(tree_error([&](TreeModel& m) {
                second(m).inertia = {};
                second(m).armature = 0.1;
              }),
              "no error");
  EXPECT_THAT(tree_error([](TreeModel& m) { m.gravity_R.x() = std::nan(""); }), HasSubstr("gravity"));
  EXPECT_THAT(tree_error([](TreeModel& m) { m.joints.resize(kMaxJoints + 1, m.joints[0]); }),
              HasSubstr("17 moving joints; at most 16"));
}

TEST(JointCouplingModel, RingsAndUnknownJointsAreRefused) {
  const auto error = [](const std::vector<MimicJoint>& mimics) -> std::string {
    try {
      const JointCoupling coupling(3, mimics);
    } catch (const std::invalid_argument& thrown) {
      return thrown.what();
    }
    return "no error";
  };
  EXPECT_EQ(error({{2, 1, 1.0, 0.0}, {1, 0, 1.0, 0.0}}), "no error");
  EXPECT_THAT(error({{2, 3, 1.0, 0.0}}), HasSubstr("joint number 3 follows number 4"));
  EXPECT_THAT(error({{2, 1, 1.0, 0.0}, {2, 0, 1.0, 0.0}}), HasSubstr("follows two joints"));
  EXPECT_THAT(error({{2, 1, 1.0, 0.0}, {1, 2, 1.0, 0.0}}), HasSubstr("ring"));
  EXPECT_THAT(error({{2, 1, std::nan(""), 0.0}}), HasSubstr("finite"));
}

}  // namespace
}  // namespace takt
