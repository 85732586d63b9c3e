#pragma once
// Vectors, rotations and poses of messages as types of Eigen and back; header only. No number changes its bits. Unit and
// frame are those of the message's field (takt_msgs.idl). A pose X_AB turns and moves coordinates in B into those in A.
#include <Eigen/Geometry>

#include "takt_msgs.h"

namespace takt {

inline Eigen::Vector3d to_eigen(const takt_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}
inline Eigen::Quaterniond to_eigen(const takt_msgs::msg::Quaternion& q) {
  return {q.w, q.x, q.y, q.z};
}
inline Eigen::Matrix3d to_eigen(const takt_msgs::msg::RotationMatrix& R) {
  return (Eigen::Matrix3d() << R.xx, R.xy, R.xz, R.yx, R.yy, R.yz, R.zx, R.zy, R.zz).finished();
}
inline Eigen::Isometry3d to_eigen(const takt_msgs::msg::Transform& wire) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = to_eigen(wire.rotation);
  X.translation() = to_eigen(wire.position);
  return X;
}

inline takt_msgs::msg::Vector3 to_vector(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
inline takt_msgs::msg::Quaternion to_quaternion(const Eigen::Quaterniond& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}
inline takt_msgs::msg::RotationMatrix to_rotation_matrix(const Eigen::Matrix3d& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
inline takt_msgs::msg::Transform to_transform(const Eigen::Isometry3d& X) {
  return {to_vector(X.translation()), to_rotation_matrix(X.linear())};
}

}  // namespace takt
