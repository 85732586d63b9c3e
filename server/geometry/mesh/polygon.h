#pragma once
// Triangulation of polygons.
#include <cstddef>
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// The time of cut_polygon grows with the square of the number of corners.
inline constexpr std::size_t kMaxPolygonCorners = 10000;

/// Cuts off corner after corner (ear clipping; O'Rourke, Computational Geometry in C, 1998, 1.4), seen along
/// the axis that is nearest to the polygon's normal. `corners`: three or more, of a simple polygon that is
/// nearly plane; may be concave. Adds n - 2 triangles that number the corners and run the same way round; a
/// convex polygon becomes a fan around its first corner. A polygon that crosses itself is cut up as well, so
/// that its edges keep their neighbours.
void cut_polygon(const std::vector<Vec3>& corners, std::vector<TriangleMesh::Triangle>& triangles);

}  // namespace takt
