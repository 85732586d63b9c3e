#pragma once
// Exact judges of small convex shapes by brute force, for tests: every axis that can separate them, every
// pair of features that can be closest.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "plant_models/spatial.h"

namespace takt::test {

inline std::vector<Vec3> to_world(const std::vector<Vec3>& points, const Pose& X_WB) {
  std::vector<Vec3> result;
  for (const Vec3& p : points) result.push_back(X_WB * p);
  return result;
}

/// The largest gap between the shapes over the axes that can separate them: positive if they are apart (then
/// a lower bound of the distance), minus the penetration depth if not. Also the axis, from a to b.
struct Gap {
  double value = -std::numeric_limits<double>::infinity();
  Vec3 axis = Vec3::UnitX();
};

inline Gap separating_gap(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  Gap best;
  const auto consider = [&](const Vec3& candidate, double size) {
    const double length = candidate.norm();
    if (!(length > 1e-9 * size)) return;
    const Vec3 n = candidate / length;
    double a_low = 1e300, a_high = -1e300, b_low = 1e300, b_high = -1e300;
    for (const Vec3& p : a) {
      a_low = std::min(a_low, n.dot(p));
      a_high = std::max(a_high, n.dot(p));
    }
    for (const Vec3& p : b) {
      b_low = std::min(b_low, n.dot(p));
      b_high = std::max(b_high, n.dot(p));
    }
    if (b_low - a_high > best.value) best = {b_low - a_high, n};
    if (a_low - b_high > best.value) best = {a_low - b_high, -n};
  };
  const auto edges = [](const std::vector<Vec3>& s) {
    std::vector<Vec3> result;
    for (std::size_t i = 0; i < s.size(); ++i)
      for (std::size_t k = i + 1; k < s.size(); ++k) result.push_back(s[k] - s[i]);
    return result;
  };
  const std::vector<Vec3> edges_a = edges(a);
  const std::vector<Vec3> edges_b = edges(b);
  for (const auto& own :
       {edges_a, edges_b})  // every pair of edges of one shape spans all its faces, and more
    for (std::size_t i = 0; i < own.size(); ++i)
      for (std::size_t k = i + 1; k < own.size(); ++k)
        consider(own[i].cross(own[k]), own[i].norm() * own[k].norm());
  for (const Vec3& e : edges_a)
    for (const Vec3& f : edges_b) consider(e.cross(f), e.norm() * f.norm());
  return best;
}

inline double point_triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  const double n2 = n.squaredNorm();
  if (!(n2 > 0.0)) return std::numeric_limits<double>::infinity();  // the test of its edges covers it
  const Vec3 foot = p - n * (n.dot(p - a) / n2);
  const bool inside = n.dot((b - a).cross(foot - a)) >= 0.0 && n.dot((c - b).cross(foot - b)) >= 0.0 &&
                      n.dot((a - c).cross(foot - c)) >= 0.0;
  return inside ? (p - foot).norm() : std::numeric_limits<double>::infinity();
}

inline double point_segment_distance(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * (b - a)).norm();
}

inline double segment_segment_distance(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  double best = std::min({point_segment_distance(a, c, d), point_segment_distance(b, c, d),
                          point_segment_distance(c, a, b), point_segment_distance(d, a, b)});
  const Vec3 u = b - a, v = d - c, n = u.cross(v), w = c - a;
  const double n2 = n.squaredNorm();
  if (n2 > 1e-18 * u.squaredNorm() * v.squaredNorm()) {
    const double s = w.cross(v).dot(n) / n2;
    const double t = w.cross(u).dot(n) / n2;
    if (s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0)
      best = std::min(best, std::abs(w.dot(n)) / std::sqrt(n2));
  }
  return best;
}

/// The exact distance of two separated shapes: all corners against all triangles, all segments against all
/// segments. Points inside the hull do not matter, because they are no closer.
inline double brute_force_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double best = std::numeric_limits<double>::infinity();
  const auto corners_to_triangles = [&best](const std::vector<Vec3>& s, const std::vector<Vec3>& t) {
    for (std::size_t i = 0; i < t.size(); ++i)
      for (std::size_t j = i + 1; j < t.size(); ++j)
        for (std::size_t k = j + 1; k < t.size(); ++k)
          for (const Vec3& p : s) best = std::min(best, point_triangle_distance(p, t[i], t[j], t[k]));
  };
  corners_to_triangles(a, b);
  corners_to_triangles(b, a);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = i + 1; j < a.size(); ++j)
      for (std::size_t k = 0; k < b.size(); ++k)
        for (std::size_t l = k + 1; l < b.size(); ++l)
          best = std::min(best, segment_segment_distance(a[i], a[j], b[k], b[l]));
  return best;
}

}  // namespace takt::test
