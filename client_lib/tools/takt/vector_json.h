#pragma once
// Vectors and quaternions (x, y, z, w) in what --json prints: an array of numbers.
#include <nlohmann/json.hpp>

#include "client_lib/cell.h"

namespace takt_msgs::msg {

inline void to_json(nlohmann::json& json, const Vector3& v) {
  json = nlohmann::json::array({v.x, v.y, v.z});
}
inline void to_json(nlohmann::json& json, const Quaternion& q) {
  json = nlohmann::json::array({q.x, q.y, q.z, q.w});
}

}  // namespace takt_msgs::msg
