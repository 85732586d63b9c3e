#include <algorithm>
#include <cmath>

#include "client_lib/render/scene.h"

namespace takt::render {

void look_at(Camera& camera, const std::vector<Vec3>& points_W, double margin, double least_distance_m) {
  if (points_W.empty()) return;
  Vec3 lower = points_W.front(), upper = lower;
  for (const Vec3& point : points_W) lower = lower.cwiseMin(point), upper = upper.cwiseMax(point);
  camera.target_W = 0.5 * (lower + upper);
  const Vec3 back = Vec3(-0.42, -0.98, 0.66).normalized();
  const Vec3 right = Vec3::UnitZ().cross(back).normalized(), up = back.cross(right);
  const double high = std::tan(0.5 * camera.vertical_view_rad),
               wide = high * camera.width_px / camera.height_px;
  double distance = least_distance_m;
  for (const Vec3& point : points_W) {
    const Vec3 p = point - camera.target_W;
    distance = std::max(
        distance, p.dot(back) + margin * std::max(std::abs(p.dot(up)) / high, std::abs(p.dot(right)) / wide));
  }
  camera.eye_W = camera.target_W + distance * back;
}

}  // namespace takt::render
