// The robots of config/robots against the published tables, and the mechanics of r3 against the check values
// of an independent calculation.
#include <gtest/gtest.h>

#include "server/scenario/urdf_arm.h"
#include "tests/support/robot_tables.h"

namespace takt {
namespace {

UrdfArm arm_of(const std::string& file, const std::string& flange = "tool0") {
  return read_urdf_arm(std::string(TAKT_CONFIG_DIR) + "/robots/" + file, "base_link", flange);
}

TreeModel tree_of(const UrdfArm& arm) {
  TreeModel tree;
  const std::vector<BodyInertia> inertias = urdf_inertias(arm).links;
  for (std::size_t i = 0; i < inertias.size(); ++i)
    tree.joints.push_back({arm.arm.joints[i], static_cast<int>(i) - 1, inertias[i]});
  return tree;
}

void expect_tree(const TreeModel& found, const TreeModel& expected) {
  ASSERT_EQ(found.joint_count(), expected.joint_count());
  for (size_t i = 0; i < found.joints.size(); ++i) {
    const TreeJoint& f = found.joints[i];
    const TreeJoint& e = expected.joints[i];
    SCOPED_TRACE(e.joint.name);
    EXPECT_EQ(f.joint.name, e.joint.name);
    EXPECT_EQ(f.parent, e.parent);
    EXPECT_EQ(f.joint.type, e.joint.type);
    EXPECT_LT((f.joint.X_PJ.R - e.joint.X_PJ.R).norm(), 1e-15);
    EXPECT_LT((f.joint.X_PJ.p - e.joint.X_PJ.p).norm(), 1e-15);
    EXPECT_EQ(f.joint.axis, e.joint.axis);
    EXPECT_NEAR(f.joint.lower, e.joint.lower, 1e-14);
    EXPECT_NEAR(f.joint.upper, e.joint.upper, 1e-14);
    EXPECT_NEAR(f.joint.max_velocity, e.joint.max_velocity, 1e-14);
    EXPECT_EQ(f.joint.max_effort, e.joint.max_effort);
    EXPECT_NEAR(f.inertia.mass_kg, e.inertia.mass_kg, 1e-14);
    EXPECT_LT((f.inertia.p_BBcm_B - e.inertia.p_BBcm_B).norm(), 1e-15);
    EXPECT_LT((f.inertia.I_BBcm_B - e.inertia.I_BBcm_B).norm(), 1e-15);
  }
}

TEST(RobotFiles, Ur10eIsThePublishedOne) {
  const UrdfArm file = arm_of("ur10e.urdf");
  expect_tree(tree_of(file), test::tree_of(test::ur10e_table()));
  EXPECT_TRUE(urdf_inertias(file).remarks.empty());
  EXPECT_EQ(file.links.back().name, "tool0");
  EXPECT_EQ(file.links.back().joint, 5);
}

TEST(RobotFiles, Kr16HasThePublishedKinematicsAndTheAssumedInertias) {
  const UrdfArm file = arm_of("kr16.urdf");
  expect_tree(tree_of(file), test::tree_of(test::kr16_table()));
  EXPECT_TRUE(urdf_inertias(file).remarks.empty());
  const ArmModel& arm = file.arm;
  ArmPoses poses;
  forward_kinematics(arm, JointArray{}.data(), poses);
  EXPECT_LT((poses.X_RF.p - Vec3(1.768, 0.0, 0.640)).norm(), 1e-12);
  EXPECT_LT((poses.X_RF.R.col(2) - Vec3::UnitX()).norm(), 1e-12);
  // Reach of the wrist's centre: 1611 mm in the data sheet.
  EXPECT_NEAR(poses.link[2].p.x() + (poses.link[4].p - poses.link[2].p).norm(), 1.6109, 5e-5);

  // Static torques of the assumption with 16 kg on the flange, arm stretched: A2 872, A3 248, A5 27 N m.
  TreeModel loaded = tree_of(file);
  BodyInertia& last = loaded.joints.back().inertia;
  last = combined(last, {16.0, Vec3::Zero(), Mat3::Zero()}, arm.X_JF);
  const MultibodyTree tree(loaded);
  MultibodyTree::Workspace w;
  JointArray still{}, tau{};
  tree.update(still.data(), still.data(), w);
  tree.inverse_dynamics(still.data(), tau.data(), w);
  EXPECT_NEAR(-tau[1], 872.0, 1.0);
  EXPECT_NEAR(-tau[2], 248.0, 1.0);
  EXPECT_NEAR(-tau[4], 27.0, 1.0);
}

TEST(RobotFiles, R3IsThatOfTheFactSheet) {
  const UrdfArm file = arm_of("r3.urdf", "flange");
  const TreeModel tree = tree_of(file);
  TreeModel expected = test::r3_tree();
  // Link 6 and the load as one, by the figures of the sheet.
  const BodyInertia& last = tree.joints.back().inertia;
  EXPECT_DOUBLE_EQ(last.mass_kg, 15.5);
  EXPECT_LT((last.p_BBcm_B - Vec3(0.098387097, 0.243548387, 0.098387097)).norm(), 1e-9);
  Mat3 tensor;
  tensor << 0.022564516, -0.004838710, -0.001209677, -0.004838710, 0.004419355, -0.004838710, -0.001209677,
      -0.004838710, 0.022564516;
  EXPECT_LT((last.I_BBcm_B - tensor).norm(), 2e-9);
  expect_tree(tree, expected);
  const std::vector<std::string> remarks = urdf_inertias(file).remarks;
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_NE(remarks[0].find("link 'link_1'"), std::string::npos) << remarks[0];
}

/// Figures as printed in the fact sheet, with the unit of the last digit.
struct CheckValues {
  JointArray q_deg;
  Vec3 flange, load;
  JointArray gravity;
  JointArray diagonal;
  std::array<double, 4> others;  // M12, M23, M25, M46
  JointArray inverse;
};

const CheckValues kChecks[] = {
    {{},
     {0.0, 2.05, 0.145},
     {0.1, 2.3, 0.245},
     {0.0, 60.15492, 60.15492, 0.0, -14.96025, 0.0},
     {13.9620154, 100.2792286, 25.4476061, 1.1955, 3.5279375, 0.3045},
     {-6.0361086, 44.3734611, 10.4321875, 0.3045},
     {-4.2463038, 155.38192538, 89.23257988, -1.1325075, -14.2277925, -2.4690075}},
    {{-60.0, 20.0, 90.0, 0.0, -110.0, 0.0},
     {-0.986525727, 1.351240474, 0.569570894},
     {-1.023128267, 1.601240474, 0.706173434},
     {0.0, -460.57344767, -256.40006830, 14.05803653, -14.96025, 0.0},
     {77.9300306, 74.8566735, 20.2662137, 3.9382454, 3.5279375, 0.3045},
     {-4.7395360, 29.0714873, 7.9565899, -0.6368334},
     {44.59440615, -365.93343228, -220.38921675, 9.35281193, -12.81100248, 0.80416761}}};

TEST(RobotFiles, R3HasTheCheckValuesOfTheFactSheet) {
  // In a cell: z up, base turned, so that gravity is along -y of the base.
  const Mat3 R_WR = rotation_from_rpy({M_PI / 2.0, 0.0, 0.0});
  TreeModel model = tree_of(arm_of("r3.urdf", "flange"));
  model.gravity_R = R_WR.transpose() * Vec3(0.0, 0.0, -9.81);
  const MultibodyTree tree(model);
  const JointArray qd{0.5, -0.4, 0.3, 1.0, -0.8, 1.2}, qdd{1.0, 2.0, -1.0, 0.5, -2.0, 3.0}, still{};
  for (const CheckValues& check : kChecks) {
    JointArray q{}, tau{};
    for (size_t i = 0; i < 6; ++i) q[i] = check.q_deg[i] * test::kDegree;
    MultibodyTree::Workspace w;
    tree.update(q.data(), still.data(), w);
    const Pose X_RL = tree.link_pose(5, w);
    // Half a unit of the last digit, and the effect of the rounded angles.
    EXPECT_LT((X_RL.p - check.flange).cwiseAbs().maxCoeff(), 0.51e-9);
    EXPECT_LT((X_RL * Vec3(0.1, 0.25, 0.1) - check.load).cwiseAbs().maxCoeff(), 0.51e-9);
    tree.inverse_dynamics(still.data(), tau.data(), w);
    for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(tau[i], check.gravity[i], 0.51e-8) << "g" << i + 1;
    MultibodyTree::MassMatrix M;
    tree.mass_matrix(M, w);
    for (int i = 0; i < 6; ++i)
      EXPECT_NEAR(M(i, i), check.diagonal[static_cast<size_t>(i)], 0.51e-7) << "M" << i + 1;
    EXPECT_NEAR(M(0, 1), check.others[0], 0.51e-7);
    EXPECT_NEAR(M(1, 2), check.others[1], 0.51e-7);
    EXPECT_NEAR(M(1, 4), check.others[2], 0.51e-7);
    EXPECT_NEAR(M(3, 5), check.others[3], 0.51e-7);
    tree.update(q.data(), qd.data(), w);
    tree.inverse_dynamics(qdd.data(), tau.data(), w);
    for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(tau[i], check.inverse[i], 0.51e-8) << "ID" << i + 1;
  }
}

}  // namespace
}  // namespace takt
