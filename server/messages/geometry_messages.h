#pragma once
// Vectors and rotations of the core as messages.
#include "plant_models/spatial.h"
#include "takt_msgs.h"

namespace takt {

inline takt_msgs::msg::Vector3 to_vector(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
inline takt_msgs::msg::Quaternion to_quaternion(const Quat& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}

}  // namespace takt
