#include "server/geometry/convex/gjk_simplex.h"

#include <limits>

namespace takt {
namespace {

/// Nearest point of a triangle to the origin, as weights of its corners.
struct Weights {
  double w[3] = {1.0, 0.0, 0.0};
};

Weights on_segment(const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp(-a.dot(ab) / length2, 0.0, 1.0) : 0.0;
  return {{1.0 - t, t, 0.0}};
}

Weights on_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = -ab.dot(a), d2 = -ac.dot(a);
  if (d1 <= 0.0 && d2 <= 0.0) return {{1.0, 0.0, 0.0}};
  const double d3 = -ab.dot(b), d4 = -ac.dot(b);
  if (d3 >= 0.0 && d4 <= d3) return {{0.0, 1.0, 0.0}};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double t = d1 / (d1 - d3);
    return {{1.0 - t, t, 0.0}};
  }
  const double d5 = -ab.dot(c), d6 = -ac.dot(c);
  if (d6 >= 0.0 && d5 <= d6) return {{0.0, 0.0, 1.0}};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double t = d2 / (d2 - d6);
    return {{1.0 - t, 0.0, t}};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {{0.0, 1.0 - t, t}};
  }
  const double scale = 1.0 / (va + vb + vc);
  return {{va * scale, vb * scale, vc * scale}};
}

constexpr double kDoubt = 1e-11;  // of the size
constexpr int kFaces[4][4] = {
    {0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};  // and the corner opposite

}  // namespace

Simplex::Place Simplex::reduce_to_nearest() {
  int index[3] = {0, 1, 2};
  Weights best;
  if (count == 1) {
    weight[0] = 1.0;
    return Place::outside;
  }
  if (count == 2) {
    best = on_segment(corner[0].y, corner[1].y);
  } else if (count == 3) {
    best = on_triangle(corner[0].y, corner[1].y, corner[2].y);
  } else {
    // Faces that have the origin on their outer side; without one the origin is inside.
    double nearest2 = std::numeric_limits<double>::infinity();
    bool inside = true;
    double scale2 = 0.0;
    for (const SimplexCorner& c : corner) scale2 = std::max(scale2, c.y.squaredNorm());
    for (const auto& face : kFaces) {
      const Vec3& a = corner[face[0]].y;
      const Vec3& b = corner[face[1]].y;
      const Vec3& c = corner[face[2]].y;
      const Vec3 normal = (b - a).cross(c - a);
      const double side_opposite = normal.dot(corner[face[3]].y - a);
      const double side_origin = -normal.dot(a);
      // If rounding could decide the side (a thin tetrahedron, an origin in the plane), the distance decides.
      const double doubt2 = kDoubt * kDoubt * normal.squaredNorm() * scale2;
      if (side_opposite * side_origin > 0.0 && side_opposite * side_opposite > doubt2 &&
          side_origin * side_origin > doubt2)
        continue;
      inside = false;
      const Weights w = on_triangle(a, b, c);
      const double d2 = (w.w[0] * a + w.w[1] * b + w.w[2] * c).squaredNorm();
      if (d2 < nearest2) {
        nearest2 = d2;
        best = w;
        index[0] = face[0], index[1] = face[1], index[2] = face[2];
      }
    }
    if (inside) {
      // The origin's weights: volumes opposite to the corners.
      const Vec3 &a = corner[0].y, &b = corner[1].y, &c = corner[2].y, &d = corner[3].y;
      const double volume = (b - a).dot((c - a).cross(d - a));
      weight[0] = b.dot(c.cross(d)) / volume;
      weight[1] = -a.dot(c.cross(d)) / volume;
      weight[2] = a.dot(b.cross(d)) / volume;
      weight[3] = 1.0 - weight[0] - weight[1] - weight[2];
      for (const double w : weight)
        if (!(w > -1e-9)) return Place::failed;
      return Place::inside;
    }
  }
  SimplexCorner kept[3];
  int kept_count = 0;
  const int candidates = std::min(count, 3);
  for (int i = 0; i < candidates; ++i) {
    if (!(best.w[i] >= 0.0)) return Place::failed;
    if (best.w[i] == 0.0) continue;
    weight[kept_count] = best.w[i];
    kept[kept_count++] = corner[index[i]];
  }
  for (int i = 0; i < kept_count; ++i) corner[i] = kept[i];
  count = kept_count;
  return Place::outside;
}

double Simplex::depth(double size) const {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& face : kFaces) {
    const Vec3& a = corner[face[0]].y;
    const Vec3 normal = (corner[face[1]].y - a).cross(corner[face[2]].y - a);
    const double length = normal.norm();
    // Rounding: about 1e-15 size^3 in the product, so 1e-9 of the size in the depth at this length.
    if (!(length > 1e-6 * size * size)) return 0.0;
    least = std::min(least, std::abs(normal.dot(a)) / length);
  }
  return std::max(0.0, least - 1e-8 * size - nearest().norm());
}

}  // namespace takt
