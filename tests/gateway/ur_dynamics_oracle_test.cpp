// Mass matrix and Coriolis torques of takt-ur against Orocos KDL, with the masses that the server reads from the same file.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client_lib/gateway/ur/motion.h"
#include "client_lib/gateway/ur/robot_dynamics.h"
#include "server/scenario/urdf_arm.h"
#include "tests/support/kdl_tree.h"

namespace takt::ur {
namespace {

const UrdfArm& arm_of_file() {
  static const UrdfArm arm = read_urdf_arm(TAKT_CONFIG_DIR "/robots/ur10e.urdf", "", "", {});
  return arm;
}

const BodyInertia kPayload{2.5, {0.03, -0.02, 0.11}, Vec3(0.02, 0.03, 0.015).asDiagonal()};

/// With the payload at the flange, by the inertias of the server.
KDL::Chain chain(const BodyInertia& payload) {
  TreeModel model;
  const UrdfInertias inertias = urdf_inertias(arm_of_file(), {});
  for (std::size_t i = 0; i < 6; ++i)
    model.joints.push_back({arm_of_file().arm.joints[i], static_cast<int>(i) - 1, inertias.links[i]});
  KDL::Chain made = test::kdl_chain(model);
  made.addSegment(
      KDL::Segment(KDL::Joint(KDL::Joint::None), test::kdl(arm_of_file().arm.X_JF), test::kdl(payload)));
  return made;
}

class Draws {
 public:
  Vector6 six(double most) {
    Vector6 values;
    for (double& one : values) one = std::uniform_real_distribution(-most, most)(engine_);
    return values;
  }

 private:
  std::mt19937 engine_{20};
};

KDL::JntArray kdl_array(const Vector6& values) {
  KDL::JntArray made(6);
  for (unsigned i = 0; i < 6; ++i) made(i) = values.at(i);
  return made;
}

TEST(RobotDynamics, MassMatrixAndCoriolisTorquesAreThoseOfKdl) {
  Draws draws;
  for (const BodyInertia& payload : {BodyInertia{}, kPayload}) {
    const RobotDynamics dynamics(arm_of_file().robot.text, arm_of_file().arm);
    const KDL::Chain model = chain(payload);
    KDL::ChainDynParam kdl(model, KDL::Vector::Zero());
    for (int draw = 0; draw < 20; ++draw) {
      const Vector6 q = draws.six(3.0), qd = draws.six(2.0);
      KDL::JntSpaceInertiaMatrix M(6);
      KDL::JntArray C(6);
      ASSERT_EQ(kdl.JntToMass(kdl_array(q), M), 0);
      ASSERT_EQ(kdl.JntToCoriolis(kdl_array(q), kdl_array(qd), C), 0);
      EXPECT_LT((dynamics.mass_matrix(q, payload) - M.data).cwiseAbs().maxCoeff(), 1e-10);
      const Vector6 torques = dynamics.coriolis_torques(q, qd, payload);
      for (unsigned i = 0; i < 6; ++i) EXPECT_NEAR(torques.at(i), C(i), 1e-10) << i;
    }
  }
}

TEST(RobotDynamics, JointsOfTheProtocolHaveTheirOwnSignAndZero) {
  ArmModel arm = arm_of_file().arm;
  const Vector6 sign{1, -1, 1, -1, -1, 1}, offset{0.1, -0.4, 0.0, 1.2, 0.3, -2.0};
  for (std::size_t i = 0; i < 6; ++i) {
    arm.joints[i].axis *= sign.at(i);
    arm.joints[i].X_PJ.R =
        arm.joints[i].X_PJ.R * Eigen::AngleAxisd(-offset.at(i), arm.joints[i].axis).toRotationMatrix();
  }
  const RobotDynamics own(arm_of_file().robot.text, arm_of_file().arm),
      of_protocol(arm_of_file().robot.text, arm);
  Draws draws;
  const Vector6 q = draws.six(3.0), qd = draws.six(2.0);
  Vector6 q_protocol, qd_protocol;
  for (std::size_t i = 0; i < 6; ++i) {
    q_protocol.at(i) = sign.at(i) * q.at(i) + offset.at(i);
    qd_protocol.at(i) = sign.at(i) * qd.at(i);
  }
  const Matrix6 M = own.mass_matrix(q, kPayload), M_protocol = of_protocol.mass_matrix(q_protocol, kPayload);
  const Vector6 C = own.coriolis_torques(q, qd, kPayload),
                C_protocol = of_protocol.coriolis_torques(q_protocol, qd_protocol, kPayload);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(C_protocol.at(i), sign.at(i) * C.at(i), 1e-10);
    for (std::size_t j = 0; j < 6; ++j) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      EXPECT_NEAR(M_protocol(row, column), sign.at(i) * sign.at(j) * M(row, column), 1e-10);
    }
  }
}

TEST(RobotDynamics, AJointBesideTheArmStandsAtItsLimit) {
  // A mass of 2 kg on a slide that stands at 0.3 m, 0.1 m beside the arm's last axis: its inertia about that axis.
  std::string urdf = arm_of_file().robot.text;
  const std::string link = arm_of_file().flange_link;
  urdf.insert(urdf.rfind("</robot>"),
              "<joint name='slide' type='prismatic'><parent link='" + link +
                  "'/><child link='tip'/><origin xyz='0.1 0 0'/><axis xyz='1 0 0'/>"
                  "<limit lower='0.3' upper='0.5' velocity='1' effort='1'/></joint>"
                  "<link name='tip'><inertial><mass value='2'/>"
                  "<inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial></link>");
  const Vector6 q{};
  const RobotDynamics with(urdf, arm_of_file().arm), without(arm_of_file().robot.text, arm_of_file().arm);
  const double added = with.mass_matrix(q, {})(5, 5) - without.mass_matrix(q, {})(5, 5);
  EXPECT_NEAR(added, 2.0 * 0.4 * 0.4, 1e-12);
}

TEST(RobotDynamics, FilesWithoutMassesAreRefusedWhenAsked) {
  const auto reason = [](const std::string& urdf, const BodyInertia& payload = {}) -> std::string {
    const RobotDynamics dynamics(urdf, arm_of_file().arm);
    try {
      (void)dynamics.mass_matrix({}, payload);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(reason(arm_of_file().robot.text), "");
  EXPECT_NE(reason("").find("URDF"), std::string::npos);
  EXPECT_NE(reason("<sdf/>").find("URDF"), std::string::npos);
  EXPECT_NE(reason("<robot name='a'/>").find(arm_of_file().arm.joints[0].name), std::string::npos);
  BodyInertia impossible = kPayload;
  impossible.I_BBcm_B(0, 0) = -1.0;
  EXPECT_NE(reason(arm_of_file().robot.text, impossible).find("payload"), std::string::npos);
}

TEST(RobotDynamics, TheRateOfTheJacobianIsItsDifferenceQuotient) {
  Draws draws;
  Motion motion(arm_of_file().arm, 0.002);
  motion.set_tool({Eigen::AngleAxisd(0.4, Vec3::UnitY()).toRotationMatrix(), {0.05, -0.1, 0.2}});
  const auto jacobian = [&](const Vector6& q) {
    Matrix6 J;
    for (std::size_t j = 0; j < 6; ++j) {
      Vector6 rate{};
      rate.at(j) = 1.0;
      const Vector6 twist = motion.tool_speed(q, rate);
      for (std::size_t i = 0; i < 6; ++i)
        J(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = twist.at(i);
    }
    return J;
  };
  for (int draw = 0; draw < 20; ++draw) {
    const Vector6 q = draws.six(3.0), qd = draws.six(2.0);
    constexpr double h = 1e-5;
    Vector6 before, after;
    for (std::size_t i = 0; i < 6; ++i) {
      before.at(i) = q.at(i) - h * qd.at(i);
      after.at(i) = q.at(i) + h * qd.at(i);
    }
    const Matrix6 quotient = (jacobian(after) - jacobian(before)) / (2.0 * h);
    EXPECT_LT((jacobian_rate(jacobian(q), qd) - quotient).cwiseAbs().maxCoeff(), 1e-8);
  }
}

}  // namespace
}  // namespace takt::ur
