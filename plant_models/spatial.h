#pragma once
// Spatial quantities shared by every room of takt.
//
// Monogram notation: X_WB is the pose of frame B in frame W (it maps coordinates in B to coordinates in W),
// R_WB its rotation, p_WB its translation, V_WB the twist of B measured in W, F_B_W a wrench acting on body B
// at the origin of B, expressed in W. Units are SI (m, rad, s, N, N m). The thesis writes T for the rotation
// from world to body: T = R_WB transposed.
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace takt {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

/// A rigid transform X_AB: p_A = R * p_B + p.
struct Pose {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();

  static Pose from_quaternion(const Vec3& p_AB, const Quat& q_AB) { return {q_AB.toRotationMatrix(), p_AB}; }
  /// The unit quaternion of R with w >= 0, so that one rotation has one representation.
  Quat quaternion() const {
    Quat q(R);
    q.normalize();
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    return q;
  }
  Pose inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
  Pose operator*(const Pose& X_BC) const { return {R * X_BC.R, R * X_BC.p + p}; }
  Vec3 operator*(const Vec3& p_B) const { return R * p_B + p; }
  bool operator==(const Pose& other) const { return R == other.R && p == other.p; }
};

/// Velocity of a frame: v is the velocity of the frame's origin (m/s), w its angular velocity (rad/s), both
/// expressed in the world frame unless a name says otherwise.
struct Twist {
  Vec3 v = Vec3::Zero();
  Vec3 w = Vec3::Zero();

  /// Velocity of a body-fixed point whose position relative to the frame's origin is r (same axes as v and
  /// w).
  Vec3 at(const Vec3& r) const { return v + w.cross(r); }
  bool operator==(const Twist& other) const { return v == other.v && w == other.w; }
};

/// Force f (N) and moment t (N m) about the named point, expressed in the world frame.
struct Wrench {
  Vec3 f = Vec3::Zero();
  Vec3 t = Vec3::Zero();

  Wrench& operator+=(const Wrench& other) {
    f += other.f;
    t += other.t;
    return *this;
  }
};

/// Rotation matrix from fixed-axis roll, pitch, yaw (the URDF convention): Rz(yaw) Ry(pitch) Rx(roll).
inline Mat3 rotation_from_rpy(const Vec3& rpy_rad) {
  return (Eigen::AngleAxisd(rpy_rad.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rpy_rad.y(), Vec3::UnitY()) *
          Eigen::AngleAxisd(rpy_rad.x(), Vec3::UnitX()))
      .toRotationMatrix();
}

}  // namespace takt
