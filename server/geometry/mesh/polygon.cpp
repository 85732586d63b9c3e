#include "server/geometry/mesh/polygon.h"

#include <Eigen/Core>
#include <limits>
#include <utility>

namespace takt {
namespace {

using Vec2 = Eigen::Vector2d;
using Triangle = TriangleMesh::Triangle;

/// Twice the signed area of a triangle; positive: counter-clockwise.
double area(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The corners seen along the axis that is nearest to the normal, so that they run counter-clockwise.
std::vector<Vec2> projected(const std::vector<Vec3>& corners) {
  Vec3 normal = Vec3::Zero();  // Newell: twice the areas of the projections
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Index first = (axis + 1) % 3, second = (axis + 2) % 3;
  if (normal[axis] < 0.0) std::swap(first, second);
  std::vector<Vec2> result;
  result.reserve(corners.size());
  for (const Vec3& p : corners) result.emplace_back(p[first], p[second]);
  return result;
}

/// Whether the triangle has an area >= `least` and contains no other corner of the polygon.
bool is_ear(const std::vector<Vec2>& p, const std::vector<std::uint32_t>& next, const Triangle& ear,
            double least) {
  const Vec2 &a = p[ear[0]], &b = p[ear[1]], &c = p[ear[2]];
  if (!(area(a, b, c) >= least)) return false;
  // A hole is joined to the outline by an edge there and back: corners may lie on one another.
  for (std::uint32_t i = next[ear[2]]; i != ear[0]; i = next[i])
    if (p[i] != a && p[i] != b && p[i] != c && area(a, b, p[i]) > 0.0 && area(b, c, p[i]) > 0.0 &&
        area(c, a, p[i]) > 0.0)
      return false;
  return true;
}

}  // namespace

void cut_polygon(const std::vector<Vec3>& corners, std::vector<Triangle>& triangles) {
  auto left = static_cast<std::uint32_t>(corners.size());
  if (left == 3) return triangles.push_back({0, 1, 2});
  const std::vector<Vec2> points = projected(corners);
  std::vector<std::uint32_t> next(left), previous(left);
  for (std::uint32_t i = 0; i < left; ++i) next[i] = (i + 1) % left, previous[i] = (i + left - 1) % left;
  // Ears with an area, else flat ones; of a polygon that crosses itself any.
  constexpr std::array<double, 2> kLeast{std::numeric_limits<double>::min(), 0.0};
  std::size_t demand = 0;
  std::uint32_t at = 1, tried = 0;
  bool behind_a_cut = false;
  while (left > 3) {
    const Triangle ear{previous[at], at, next[at]};
    if (demand == kLeast.size() || is_ear(points, next, ear, kLeast[demand])) {
      triangles.push_back(ear);
      next[ear[0]] = ear[2], previous[ear[2]] = ear[0];
      at = ear[2];
      behind_a_cut = true;
      --left, tried = 0;
    } else if (behind_a_cut) {  // the corner in front of it; of a thin ring the next ear is there
      at = previous[at];
      behind_a_cut = false;
    } else {
      at = next[at];
      if (++tried > left) tried = 0, ++demand;
    }
  }
  triangles.push_back({previous[at], at, next[at]});
}

}  // namespace takt
