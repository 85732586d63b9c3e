#include "server/geometry/convex/distance.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "server/geometry/convex/epa_polytope.h"

namespace takt {
namespace {

constexpr int kMaxRounds = 100;
constexpr double kTolerance = 1e-10;  // of the size: width of the bracket
constexpr double kOnOrigin = 1e-11;   // of the size: the simplex contains the origin
constexpr double kThinnest = 1e-12;   // of the size squared: twice the area of a face of the polytope

void set_points(const Vec3& point_A, const Pose& X_WA, const Vec3& point_B, const Pose& X_WB,
                ConvexDistance& result) {
  result.point_A_W = X_WA * point_A;
  result.point_B_W = X_WB * point_B;
}

}  // namespace

ConvexDistance convex_distance(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b,
                               const Pose& X_WB) {
  check_query(X_WA, X_WB, 0.0);
  ConvexDistance result;
  Difference difference(a, X_WA, b, X_WB);
  const double size = std::max(a.radius + b.radius, 1e-300);
  Simplex simplex;
  Vec3 v = a.center_B - (difference.R_AB * b.center_B + difference.p_AB);
  if (!(v.squaredNorm() < 1e300))
    throw std::invalid_argument("two convex shapes are too far apart to compute their distance");
  if (!(v.squaredNorm() > 0.0)) v = Vec3::UnitX();
  double lower = -std::numeric_limits<double>::infinity();
  bool inside = false;
  for (int round = 0; round < kMaxRounds; ++round) {
    const double length = v.norm();
    const Vec3 n = v / -length;
    const SimplexCorner corner = difference.extreme(n);
    const double gap = -n.dot(corner.y);
    if (gap > lower) {
      lower = gap;
      result.normal_W = X_WA.R * n;
    }
    if (round > 0 && length - lower <= kTolerance * size) break;
    if (!simplex.add(corner)) break;
    const Simplex last = simplex;
    const Simplex::Place place = simplex.reduce_to_nearest();
    if (place == Simplex::Place::failed) {
      simplex = last;
      break;
    }
    v = simplex.nearest();
    inside = place == Simplex::Place::inside || !(v.norm() > kOnOrigin * size);
    if (inside) break;
  }
  if (!inside) {
    Vec3 point_A = Vec3::Zero(), point_B = Vec3::Zero();
    for (int i = 0; i < simplex.count; ++i) {
      point_A += simplex.weight[i] * simplex.corner[i].a;
      point_B += simplex.weight[i] * simplex.corner[i].b;
    }
    set_points(point_A, X_WA, point_B, X_WB, result);
    result.distance = v.norm();
    result.error = std::max(0.0, result.distance - std::max(lower, 0.0));
    return result;
  }
  Polytope polytope;
  if (!polytope.begin(simplex, difference, size)) {
    // The difference is flat and contains the origin: the shapes touch, and motion normal to the plane parts
    // them.
    Vec3 point_A = Vec3::Zero(), point_B = Vec3::Zero();
    for (int i = 0; i < simplex.count; ++i) {
      point_A += simplex.weight[i] * simplex.corner[i].a;
      point_B += simplex.weight[i] * simplex.corner[i].b;
    }
    set_points(point_A, X_WA, point_B, X_WB, result);
    return result;
  }
  polytope.grow(difference, kTolerance * size, std::numeric_limits<double>::infinity(), kThinnest);
  Vec3 point_A, point_B;
  polytope.witness(point_A, point_B);
  set_points(point_A, X_WA, point_B, X_WB, result);
  result.normal_W = X_WA.R * polytope.normal();
  result.distance = -std::max(polytope.lower(), 0.0);
  result.error = std::max(0.0, polytope.upper() - std::max(polytope.lower(), 0.0));
  return result;
}

}  // namespace takt
