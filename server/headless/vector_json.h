#pragma once
// Vectors and quaternions (x, y, z, w) in reports.
#include <nlohmann/json.hpp>

#include "plant_models/spatial.h"

namespace takt {

inline nlohmann::ordered_json vector_json(const Vec3& v) {
  return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
}
inline nlohmann::ordered_json rotation_json(const Quat& q) {
  return nlohmann::ordered_json::array({q.x(), q.y(), q.z(), q.w()});
}

}  // namespace takt
