#pragma once
// Convex shapes and their overlap by Minkowski Portal Refinement (thesis 2.1.1, 4.2). This is the only place
// that knows libccd (and, for the hull, qhull).
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/aabb.h"
#include "server/geometry/triangle_mesh.h"

namespace takt {

/// The convex hull of a set of points in the frame B of a body. Points inside the hull do no harm but cost
/// time.
struct ConvexShape {
  std::vector<Vec3> vertices;
  Vec3 center_B = Vec3::Zero();  ///< a point well inside: the mean of the vertices
  BodyBox box;                   ///< bounds of the vertices
  double radius = 0.0;           ///< half diagonal of the box (m): the size that tolerances refer to
  bool is_box = false;  ///< the vertices are exactly the corners of `box`: extreme points cost no search

  /// As they are. Throws std::invalid_argument when there are none or one is not finite.
  static ConvexShape from_points(std::vector<Vec3> points);
  /// Becomes the box between two corners; does not allocate when it had eight vertices before.
  void become_box(const Vec3& lower_B, const Vec3& upper_B);
};

/// Extreme points of the convex hull (qhull), in the order given. Throws std::invalid_argument when a point
/// is not finite or the points span no volume.
std::vector<Vec3> convex_hull_vertices(const std::vector<Vec3>& points);

/// The surface of the convex hull in triangles that face outwards; its vertices are all the points, in the
/// order given. Throws as convex_hull_vertices.
TriangleMesh convex_hull_mesh(const std::vector<Vec3>& points);

/// True if the two shapes, each at its pose, come closer than `margin` (m, >= 0): one of them is grown by a
/// ball of that radius, so the answer does not depend on the choice of axes. Touching counts; the verdict is
/// exact up to 1e-8 of the sum of the shapes' radii. Poses must be finite (libccd answers "no contact" for a
/// NaN); the caller checks states before poses are made of them, and that the bounding boxes overlap, which
/// this does not repeat. Bounded time: the number of iterations is limited, and a search that hits the limit
/// counts as touching. Does not allocate. Shapes must come from ConvexShape::from_points.
bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                    double margin);

}  // namespace takt
