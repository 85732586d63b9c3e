#include "server/geometry/segment_distance.h"

#include <algorithm>

namespace takt {
namespace {

/// Whether the projection of `point` onto the plane of the triangle (normal not unit) is within the triangle.
bool foot_inside(const Vec3& point, const std::array<Vec3, 3>& t, const Vec3& normal) {
  for (std::size_t k = 0; k < 3; ++k)
    if (normal.dot((t[(k + 1) % 3] - t[k]).cross(point - t[k])) < 0.0) return false;
  return true;
}

}  // namespace

Vec3 closest_on_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double s = length2 > 0.0 ? std::clamp((point - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return a + s * ab;
}

double point_segment_squared_distance(const Vec3& point, const Vec3& a, const Vec3& b) {
  return (point - closest_on_segment(point, a, b)).squaredNorm();
}

double segment_segment_squared_distance(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b) {
  // Either the lines are closest inside both segments, or an end of one belongs to the closest pair.
  double least = std::min({point_segment_squared_distance(p, a, b), point_segment_squared_distance(q, a, b),
                           point_segment_squared_distance(a, p, q), point_segment_squared_distance(b, p, q)});
  const Vec3 u = q - p, v = b - a, w = p - a;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w), vw = v.dot(w);
  const double determinant = uu * vv - uv * uv;
  if (determinant > 0.0) {
    const double s = (uv * vw - vv * uw) / determinant, t = (uu * vw - uv * uw) / determinant;
    if (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) least = std::min(least, (w + s * u - t * v).squaredNorm());
  }
  return least;
}

double point_triangle_squared_distance(const Vec3& point, const std::array<Vec3, 3>& t) {
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  if (foot_inside(point, t, normal)) {
    const double height = normal.dot(point - t[0]);
    return height * height / normal.squaredNorm();
  }
  return std::min({point_segment_squared_distance(point, t[0], t[1]),
                   point_segment_squared_distance(point, t[1], t[2]),
                   point_segment_squared_distance(point, t[2], t[0])});
}

double segment_triangle_squared_distance(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& t) {
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double height_p = normal.dot(p - t[0]), height_q = normal.dot(q - t[0]);
  if (height_p * height_q <= 0.0 && height_p != height_q) {
    const Vec3 crossing = p + height_p / (height_p - height_q) * (q - p);
    if (foot_inside(crossing, t, normal)) return 0.0;
  }
  return std::min({point_triangle_squared_distance(p, t), point_triangle_squared_distance(q, t),
                   segment_segment_squared_distance(p, q, t[0], t[1]),
                   segment_segment_squared_distance(p, q, t[1], t[2]),
                   segment_segment_squared_distance(p, q, t[2], t[0])});
}

}  // namespace takt
