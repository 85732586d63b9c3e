#pragma once
// A UR10e by the parameters that its manufacturer publishes.
#include <cmath>
#include <numbers>

#include "client_lib/gateway/ur/motion.h"

namespace takt::test {

using ur::Vector6;

// DH parameters of a UR10e as its manufacturer publishes them (article "DH parameters for calculations of kinematics and
// dynamics"): a, d in m, alpha in rad; theta is 0.
inline constexpr std::array<double, 6> kA{0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0};
inline constexpr std::array<double, 6> kD{0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655};
inline const std::array<double, 6> kAlpha{std::numbers::pi / 2,  0.0, 0.0, std::numbers::pi / 2,
                                          -std::numbers::pi / 2, 0.0};

inline Pose dh(double theta, double d, double a, double alpha) {
  const Mat3 Rz = Eigen::AngleAxisd(theta, Vec3::UnitZ()).toRotationMatrix();
  return {Rz * Eigen::AngleAxisd(alpha, Vec3::UnitX()).toRotationMatrix(),
          Vec3(0, 0, d) + Rz * Vec3(a, 0, 0)};
}

/// A robot whose joint i is about the z axis of DH frame i - 1.
inline ArmModel ur10e() {
  ArmModel arm;
  for (std::size_t i = 0; i < 6; ++i) {
    JointModel joint;
    if (i > 0) joint.X_PJ = dh(0.0, kD.at(i - 1), kA.at(i - 1), kAlpha.at(i - 1));
    joint.lower = -6.28;
    joint.upper = 6.28;
    joint.max_velocity = 2.0;
    arm.joints.push_back(joint);
  }
  arm.X_JF = dh(0.0, kD[5], kA[5], kAlpha[5]);
  return arm;
}

inline constexpr Vector6 kHome{0.1, -1.3, 1.6, -1.4, -1.57, 0.3};

}  // namespace takt::test
