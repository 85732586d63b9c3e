#pragma once
// Convex shapes and their overlap by Minkowski Portal Refinement (thesis 2.1.1, 4.2). This is the only place that knows
// libccd (and, for the hull, qhull).
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/aabb.h"
#include "server/geometry/triangle_mesh.h"

namespace takt {

/// The convex hull of a set of points in the frame B of a body. Points inside the hull do no harm but cost time.
struct ConvexShape {
  std::vector<Vec3> vertices;
  Vec3 center_B = Vec3::Zero();  ///< a point well inside: the mean of the vertices
  BodyBox box;                   ///< bounds of the vertices

  static ConvexShape from_points(std::vector<Vec3> points);  ///< as they are
};

/// Extreme points of the convex hull (qhull). Throws std::invalid_argument when the points span no volume.
std::vector<Vec3> convex_hull_vertices(const std::vector<Vec3>& points);

/// True if the two shapes, each at its pose, come closer than `margin` (m): one of them is grown by a ball of that
/// radius, so the answer does not depend on the choice of axes. Touching counts. Poses must be finite (libccd answers
/// "no contact" for a NaN); the caller checks states before poses are made of them. Bounded time: the number of
/// iterations is limited, and a search that hits the limit counts as touching.
bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB, double margin);

}  // namespace takt
