#pragma once
// Convex shapes with a radius: spheres are points and capsules are segments, both exact. The distance of two
// bodies made of such shapes; bounding boxes shorten the computation for distant bodies.
#include <limits>
#include <vector>

#include "server/geometry/convex/distance.h"

namespace takt {

/// All points no further than `radius_m` from the core.
struct RoundedShape {
  ConvexShape core;
  double radius_m = 0.0;
};

/// A ball that holds all shapes of a body (in their frame), and their largest distance from the origin.
struct ShapeBounds {
  Vec3 center_B = Vec3::Zero();
  double radius_m = 0.0;
  double reach_m = 0.0;
};
ShapeBounds bounds_of(const std::vector<RoundedShape>& shapes);

/// The shapes of a body moved to another frame: X_FB maps the shapes' frame to F.
RoundedShape moved(const RoundedShape& shape, const Pose& X_FB);

struct BodyDistance {
  /// Smallest distance (m); negative: minus the depth of the pair of shapes that overlaps deepest.
  double distance_m = std::numeric_limits<double>::infinity();
  double at_least_m = std::numeric_limits<double>::infinity();  ///< lower bound of the true distance
  bool exact = false;         ///< false: only `at_least_m` is valid, and it exceeds `enough_m`
  Vec3 p_W = Vec3::Zero();    ///< exact: halfway between the nearest points, or the deepest ones
  std::uint32_t queries = 0;  ///< distances of two convex shapes that were computed
};

/// Distance of two bodies. If boxes around the shapes prove that they are further apart than `enough_m`, the
/// result is only a bound. Poses must be finite. Does not allocate; the same arguments give the same bits.
BodyDistance body_distance(const std::vector<RoundedShape>& a, const ShapeBounds& bounds_a, const Pose& X_WA,
                           const std::vector<RoundedShape>& b, const ShapeBounds& bounds_b, const Pose& X_WB,
                           double enough_m);

}  // namespace takt
