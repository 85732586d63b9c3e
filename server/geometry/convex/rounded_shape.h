#pragma once
// Convex shapes with a radius: spheres are points and capsules are segments, both exact. How far two bodies
// made of such shapes are apart, cheaply where they are far apart.
#include <limits>
#include <vector>

#include "server/geometry/convex/distance.h"

namespace takt {

/// All points no further than `radius_m` from the core.
struct RoundedShape {
  ConvexShape core;
  double radius_m = 0.0;
};

/// A ball that holds all of them (in the frame of the shapes), and how far they reach from the origin.
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
  double at_least_m = std::numeric_limits<double>::infinity();  ///< the true distance is not less than this
  bool exact = false;         ///< else only `at_least_m` is known, and it is beyond `enough_m`
  Vec3 p_W = Vec3::Zero();    ///< exact: halfway between the nearest points, or the deepest ones
  std::uint32_t queries = 0;  ///< distances of two convex shapes that were computed
};

/// Distance of two bodies. Where boxes around the shapes prove that they are further apart than `enough_m`
/// nothing else is asked. Poses must be finite. Does not allocate; the same arguments give the same bits.
BodyDistance body_distance(const std::vector<RoundedShape>& a, const ShapeBounds& bounds_a, const Pose& X_WA,
                           const std::vector<RoundedShape>& b, const ShapeBounds& bounds_b, const Pose& X_WB,
                           double enough_m);

}  // namespace takt
