// The UR10e's kinematics against Orocos KDL, whose chain is built here from the published table (not from the
// URDF).
#include <gtest/gtest.h>

#include <cmath>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>
#include <random>

#include "server/scenario/urdf_arm.h"

namespace takt {
namespace {

struct TableRow {
  double x, y, z, roll, pitch, yaw;
  double range_deg, speed_deg_per_s, torque_N_m;
};

const TableRow kPublishedRows[] = {{0.0, 0.0, 0.1807, 0.0, 0.0, 0.0, 360.0, 120.0, 330.0},
                                   {0.0, 0.0, 0.0, M_PI / 2.0, 0.0, 0.0, 360.0, 120.0, 330.0},
                                   {-0.6127, 0.0, 0.0, 0.0, 0.0, 0.0, 180.0, 180.0, 150.0},
                                   {-0.57155, 0.0, 0.17415, 0.0, 0.0, 0.0, 360.0, 180.0, 54.0},
                                   {0.0, -0.11985, 0.0, M_PI / 2.0, 0.0, 0.0, 360.0, 180.0, 54.0},
                                   {0.0, 0.11655, 0.0, M_PI / 2.0, M_PI, M_PI, 360.0, 180.0, 54.0}};

/// A KDL segment is a joint followed by a fixed frame: the frame of row i + 1 belongs to segment i.
KDL::Chain kdl_chain() {
  const auto frame = [](const TableRow& row) {
    return KDL::Frame(KDL::Rotation::RPY(row.roll, row.pitch, row.yaw), KDL::Vector(row.x, row.y, row.z));
  };
  KDL::Chain chain;
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(kPublishedRows[0])));
  for (int i = 0; i < 6; ++i) {
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ),
                                  i < 5 ? frame(kPublishedRows[i + 1]) : KDL::Frame::Identity()));
  }
  return chain;
}

class Ur10e : public testing::Test {
 protected:
  JointArray random_joints() {
    JointArray q{};
    for (size_t i = 0; i < 6; ++i)
      q[i] = std::uniform_real_distribution<double>(-2.0 * M_PI, 2.0 * M_PI)(random_);
    return q;
  }
  ArmModel arm_ =
      read_urdf_arm(std::string(TAKT_CONFIG_DIR) + "/robots/ur10e.urdf", "base_link", "tool0").arm;
  std::mt19937 random_{20};
};

TEST_F(Ur10e, LimitsAreThePublishedOnes) {
  ASSERT_EQ(arm_.joint_count(), 6);
  for (size_t i = 0; i < 6; ++i) {
    const double degree = M_PI / 180.0;
    EXPECT_NEAR(arm_.joints[i].lower, -kPublishedRows[i].range_deg * degree, 1e-15);
    EXPECT_NEAR(arm_.joints[i].upper, kPublishedRows[i].range_deg * degree, 1e-15);
    EXPECT_NEAR(arm_.joints[i].max_velocity, kPublishedRows[i].speed_deg_per_s * degree, 1e-15);
    EXPECT_EQ(arm_.joints[i].max_effort, kPublishedRows[i].torque_N_m);
  }
}

TEST_F(Ur10e, FlangePoseAndJacobianEqualThoseOfKdl) {
  KDL::Chain chain = kdl_chain();
  KDL::ChainFkSolverPos_recursive forward(chain);
  KDL::ChainJntToJacSolver jacobian(chain);
  for (int n = 0; n < 1000; ++n) {
    const JointArray q = random_joints();
    KDL::JntArray q_kdl(6);
    for (unsigned i = 0; i < 6; ++i) q_kdl(i) = q[i];
    KDL::Frame frame;
    KDL::Jacobian J_kdl(6);
    ASSERT_GE(forward.JntToCart(q_kdl, frame), 0);
    ASSERT_GE(jacobian.JntToJac(q_kdl, J_kdl), 0);
    ArmPoses poses;
    forward_kinematics(arm_, q.data(), poses);
    const ArmJacobian J = flange_jacobian(arm_, poses);
    for (int r = 0; r < 3; ++r) {
      ASSERT_NEAR(poses.X_RF.p(r), frame.p(r), 1e-12);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(poses.X_RF.R(r, c), frame.M(r, c), 1e-12);
    }
    for (unsigned r = 0; r < 6; ++r) {
      for (unsigned c = 0; c < 6; ++c) ASSERT_NEAR(J(r, c), J_kdl(r, c), 1e-12);
    }
  }
}

TEST_F(Ur10e, TheJacobianIsTheDerivativeOfThePose) {
  constexpr double h = 1e-6;
  for (int n = 0; n < 100; ++n) {
    const JointArray q = random_joints();
    ArmPoses poses;
    forward_kinematics(arm_, q.data(), poses);
    const ArmJacobian J = flange_jacobian(arm_, poses);
    for (int j = 0; j < 6; ++j) {
      JointArray ahead = q, behind = q;
      ahead[static_cast<size_t>(j)] += h;
      behind[static_cast<size_t>(j)] -= h;
      ArmPoses next, last;
      forward_kinematics(arm_, ahead.data(), next);
      forward_kinematics(arm_, behind.data(), last);
      const Vec3 v = (next.X_RF.p - last.X_RF.p) / (2.0 * h);
      const Mat3 spin = (next.X_RF.R - last.X_RF.R) / (2.0 * h) * poses.X_RF.R.transpose();
      ASSERT_LT((J.col(j).head<3>() - v).norm(), 1e-8);
      ASSERT_LT((J.col(j).tail<3>() - Vec3(spin(2, 1), spin(0, 2), spin(1, 0))).norm(), 1e-8);
    }
  }
}

TEST_F(Ur10e, TheTwistIsTheJacobianTimesTheJointVelocity) {
  for (int n = 0; n < 200; ++n) {
    const JointArray q = random_joints(), qd = random_joints();
    ArmPoses poses;
    forward_kinematics(arm_, q.data(), poses);
    const Eigen::Matrix<double, 6, 1> V =
        flange_jacobian(arm_, poses) * Eigen::Map<const Eigen::Matrix<double, 6, 1>>(qd.data());
    const Twist twist = flange_twist(arm_, poses, qd.data());
    ASSERT_LT((V.head<3>() - twist.v).norm(), 1e-12);
    ASSERT_LT((V.tail<3>() - twist.w).norm(), 1e-12);
  }
}

TEST_F(Ur10e, TheFlangePointsOutwards) {
  const JointArray q = random_joints();
  ArmPoses poses;
  forward_kinematics(arm_, q.data(), poses);
  // From the wrist's second axis to the flange the way is 0.11655 m along the flange's z.
  const Vec3 out = poses.X_RF.p - poses.link[4].p;
  EXPECT_LT((out - 0.11655 * poses.X_RF.R.col(2)).norm(), 1e-12);
}

}  // namespace
}  // namespace takt
