#pragma once
// Distance or penetration depth of two convex shapes, with the points where it occurs (thesis 4.2 uses
// ccdMPRPenetration and GJK; the former is inexact by design). GJK serves separated shapes, the expanding
// polytope algorithm overlapping ones; both end with a bracket of the result.
#include "server/geometry/convex/convex_shape.h"

namespace takt {

struct ConvexDistance {
  /// Positive: the smallest distance of a point of A and a point of B. Negative: minus the penetration depth,
  /// the length of the shortest translation that separates the shapes (m).
  double distance = 0.0;
  /// Width of the bracket that the search ended with (m): about 1e-10 of the size of the shapes, more only
  /// for shapes thousands of times longer than thick that nearly touch.
  double error = 0.0;
  Vec3 normal_W = Vec3::UnitZ();  ///< unit, from A to B: moving B along it increases the distance
  Vec3 point_A_W = Vec3::Zero();  ///< the point of A nearest to B; where they overlap, deepest inside B
  Vec3 point_B_W = Vec3::Zero();  ///< the same of B: point_B = point_A + distance * normal
};

/// Throws as check_query, and for poses so far away (1e150 m) that squares overflow. Of several nearest
/// points one is returned. Does not allocate, bounded time; takes microseconds: for reports and queries, not
/// for every pair in every step.
ConvexDistance convex_distance(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b,
                               const Pose& X_WB);

}  // namespace takt
