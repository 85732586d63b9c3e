#include "server/geometry/convex/rounded_shape.h"

#include <algorithm>

namespace takt {

namespace {

/// Lower bound of the distance of the boxes around two shapes, along the axes of either box.
double box_bound(const BodyBox& a, const BodyBox& b, const Pose& X_AB, const Mat3& abs_R) {
  const Vec3 between_A = X_AB * b.center_B - a.center_B;
  const Vec3 between_B = X_AB.R.transpose() * between_A;
  const Vec3 gap_A = (between_A.cwiseAbs() - a.half_B - abs_R * b.half_B).cwiseMax(0.0);
  const Vec3 gap_B = (between_B.cwiseAbs() - b.half_B - abs_R.transpose() * a.half_B).cwiseMax(0.0);
  return std::sqrt(std::max(gap_A.squaredNorm(), gap_B.squaredNorm()));
}

}  // namespace

ShapeBounds bounds_of(const std::vector<RoundedShape>& shapes) {
  ShapeBounds bounds;
  if (shapes.empty()) return bounds;
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 upper = -lower;
  for (const RoundedShape& shape : shapes) {
    for (const Vec3& v : shape.core.vertices) {
      lower = lower.cwiseMin(v - Vec3::Constant(shape.radius_m));
      upper = upper.cwiseMax(v + Vec3::Constant(shape.radius_m));
      bounds.reach_m = std::max(bounds.reach_m, v.norm() + shape.radius_m);
    }
  }
  bounds.center_B = 0.5 * (lower + upper);
  for (const RoundedShape& shape : shapes) {
    for (const Vec3& v : shape.core.vertices)
      bounds.radius_m = std::max(bounds.radius_m, (v - bounds.center_B).norm() + shape.radius_m);
  }
  return bounds;
}

RoundedShape moved(const RoundedShape& shape, const Pose& X_FB) {
  std::vector<Vec3> vertices;
  for (const Vec3& v : shape.core.vertices) vertices.push_back(X_FB * v);
  return {ConvexShape::from_points(std::move(vertices)), shape.radius_m};
}

BodyDistance body_distance(const std::vector<RoundedShape>& a, const ShapeBounds& bounds_a, const Pose& X_WA,
                           const std::vector<RoundedShape>& b, const ShapeBounds& bounds_b, const Pose& X_WB,
                           double enough_m) {
  BodyDistance result;
  const Vec3 center_A = X_WA * bounds_a.center_B, center_B = X_WB * bounds_b.center_B;
  const double balls = (center_B - center_A).norm() - bounds_a.radius_m - bounds_b.radius_m;
  if (balls > enough_m) {
    result.distance_m = result.at_least_m = balls;
    return result;
  }
  const Pose X_AB = X_WA.inverse() * X_WB;
  const Mat3 abs_R = X_AB.R.cwiseAbs();
  double apart = std::numeric_limits<double>::infinity();  // of the skipped pairs of shapes
  for (const RoundedShape& shape_a : a) {
    for (const RoundedShape& shape_b : b) {
      const double radii = shape_a.radius_m + shape_b.radius_m;
      const double bound = box_bound(shape_a.core.box, shape_b.core.box, X_AB, abs_R) - radii;
      // A bound of at least 0 does not limit the depth of an overlap.
      if (bound > enough_m || (bound > 0.0 && bound >= result.distance_m)) {
        apart = std::min(apart, bound);
        continue;
      }
      const ConvexDistance d = convex_distance(shape_a.core, X_WA, shape_b.core, X_WB);
      ++result.queries;
      const double distance = d.distance - radii;
      result.at_least_m = std::min(result.at_least_m, distance - d.error);
      if (distance >= result.distance_m) continue;
      result.distance_m = distance;
      result.p_W =
          0.5 * (d.point_A_W + shape_a.radius_m * d.normal_W + d.point_B_W - shape_b.radius_m * d.normal_W);
    }
  }
  result.exact = result.distance_m <= apart;
  result.at_least_m = std::min(result.at_least_m, apart);
  if (!result.exact) result.distance_m = result.at_least_m;
  return result;
}

}  // namespace takt
