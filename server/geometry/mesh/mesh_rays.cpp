#include "server/geometry/mesh/mesh_rays.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace takt {

namespace {

std::vector<Aabb> boxes_of(const TriangleMesh& mesh) {
  std::vector<Aabb> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &A = mesh.vertices[a], &B = mesh.vertices[b], &C = mesh.vertices[c];
    boxes.push_back({A.cwiseMin(B).cwiseMin(C), A.cwiseMax(B).cwiseMax(C)});
  }
  return boxes;
}

/// Whether the triangle, in the frame of the box, is apart from it along this axis.
bool apart(const Vec3& axis, const std::array<Vec3, 3>& corners, const Vec3& half) {
  const double p0 = axis.dot(corners[0]), p1 = axis.dot(corners[1]), p2 = axis.dot(corners[2]);
  const double reach = half.dot(axis.cwiseAbs());
  return std::min({p0, p1, p2}) > reach || std::max({p0, p1, p2}) < -reach;
}

bool triangle_meets_box(const std::array<Vec3, 3>& corners, const Vec3& half) {
  for (int k = 0; k < 3; ++k)
    if (apart(Vec3::Unit(k), corners, half)) return false;
  const std::array<Vec3, 3> edges{corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]};
  if (apart(edges[0].cross(edges[1]), corners, half)) return false;
  for (const Vec3& edge : edges)
    for (int k = 0; k < 3; ++k)
      if (apart(Vec3::Unit(k).cross(edge), corners, half)) return false;
  return true;
}

}  // namespace

MeshRays::MeshRays(const TriangleMesh& mesh) : tree_(boxes_of(mesh)) {
  triangles_.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    triangles_.push_back({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]});
}

MeshRays::Hit MeshRays::hit(const Vec3& p, const Vec3& q) const {
  Hit nearest;
  const Vec3 d = q - p;
  tree_.visit_segment(p, q, 0.0, [&](std::int32_t index) {
    const Triangle& t = triangles_[static_cast<std::size_t>(index)];
    const Vec3 e1 = t.b - t.a, e2 = t.c - t.a;
    const Vec3 h = d.cross(e2);
    const double det = e1.dot(h);
    // A ray in the plane of a triangle meets its neighbours.
    if (std::abs(det) <= 1e-14 * d.norm() * e1.norm() * e2.norm()) return;
    const Vec3 s = p - t.a;
    const double u = s.dot(h) / det;
    const Vec3 k = s.cross(e1);
    const double v = d.dot(k) / det;
    // No ray slips through an edge by rounding.
    constexpr double kTiny = 1e-12;
    if (u < -kTiny || v < -kTiny || u + v > 1.0 + kTiny) return;
    const double share = e2.dot(k) / det;
    if (share < 0.0 || share > 1.0 || share >= nearest.share) return;
    nearest = {share, d.dot(e1.cross(e2))};
  });
  return nearest;
}

double MeshRays::first_hit(const Vec3& p_B, const Vec3& q_B) const {
  return hit(p_B, q_B).share;
}

bool MeshRays::contains(const Vec3& p_B) const {
  const BodyBox& box = bounds();
  if (((p_B - box.center_B).cwiseAbs().array() > box.half_B.array()).any()) return false;
  // Along no plane or edge of usual parts.
  const Vec3 direction = Vec3(0.5773, 0.6180, 0.5337).normalized();
  const Hit first = hit(p_B, p_B + 2.1 * box.half_B.norm() * direction);
  return first.share <= 1.0 && first.along_normal > 0.0;
}

bool MeshRays::meets_segment(const Vec3& p_B, const Vec3& q_B) const {
  return first_hit(p_B, q_B) <= 1.0 || contains(p_B);
}

bool MeshRays::meets_box(const Pose& X_BV, const Vec3& half_m) const {
  const BodyBox whole{Vec3::Zero(), half_m};
  const Aabb around = whole.at(X_BV, 0.0);
  const Pose X_VB = X_BV.inverse();
  const bool apart_everywhere = tree_.walk(
      [&](const BodyBox& box, std::int32_t) {
        return ((box.center_B - box.half_B).array() <= around.upper.array()).all() &&
               ((box.center_B + box.half_B).array() >= around.lower.array()).all();
      },
      [&](std::int32_t index) {
        const Triangle& t = triangles_[static_cast<std::size_t>(index)];
        return !triangle_meets_box({X_VB * t.a, X_VB * t.b, X_VB * t.c}, half_m);
      });
  return !apart_everywhere || contains(X_BV.p);
}

}  // namespace takt
