#pragma once
// Conversions between takt (rad, m, rotation matrices) and the units of KUKA and ABB: degrees, millimetres, and angles
// about the axes z, y', x'' (KUKA: A, B, C; ABB: z, y, x of an Euler triple).
#include <array>
#include <cmath>
#include <numbers>

#include "plant_models/spatial.h"

namespace takt::gateway {

/// Axes 1 to 6, or X Y Z A B C, in the unit of the vendor: degrees or millimetres.
using Six = std::array<double, 6>;

inline double degrees_of(double rad) {
  return rad * (180.0 / std::numbers::pi);
}
inline double radians_of(double degrees) {
  return degrees * (std::numbers::pi / 180.0);
}

/// R = Rz(angles[0]) Ry(angles[1]) Rx(angles[2]); degrees.
inline Mat3 rotation_of_zyx(double z_deg, double y_deg, double x_deg) {
  return (Eigen::AngleAxisd(radians_of(z_deg), Vec3::UnitZ()) *
          Eigen::AngleAxisd(radians_of(y_deg), Vec3::UnitY()) *
          Eigen::AngleAxisd(radians_of(x_deg), Vec3::UnitX()))
      .toRotationMatrix();
}

/// The angles of `rotation_of_zyx`, degrees; y in [-90, 90]. With y at +-90 degrees only the sum or difference of z and
/// x counts, and x is 0.
inline std::array<double, 3> zyx_of_rotation(const Mat3& R) {
  const double across = std::hypot(R(0, 0), R(1, 0));
  const double y = std::atan2(-R(2, 0), across);
  if (across < 1e-9) return {degrees_of(std::atan2(-R(0, 1), R(1, 1))), degrees_of(y), 0.0};
  return {degrees_of(std::atan2(R(1, 0), R(0, 0))), degrees_of(y), degrees_of(std::atan2(R(2, 1), R(2, 2)))};
}

/// X Y Z in mm, A B C in degrees.
inline Six xyzabc_of(const Pose& X) {
  const auto angles = zyx_of_rotation(X.R);
  return {X.p.x() * 1e3, X.p.y() * 1e3, X.p.z() * 1e3, angles[0], angles[1], angles[2]};
}
inline Pose pose_of_xyzabc(const Six& values) {
  return {rotation_of_zyx(values[3], values[4], values[5]), Vec3(values[0], values[1], values[2]) * 1e-3};
}

}  // namespace takt::gateway
