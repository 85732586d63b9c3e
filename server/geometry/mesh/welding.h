#pragma once
// Repairs of connections that move nothing by more than the resolution of a file: vertices that are one within single
// precision, and bodies that touch along an edge.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

struct ConnectionRepair {
  std::size_t count = 0;      ///< vertices or edges
  double furthest_m = 0.0;    ///< distance of joined vertices
  Vec3 place = Vec3::Zero();  ///< of the first
};

/// Distance below which positions are equal within single precision, of vertices with coordinates up to `size`.
double single_precision_m(double size);

/// Joins those of the given vertices (ascending) that are no further apart than `near_m`, at the place of the one with
/// the lowest number. Triangles may then name a vertex twice.
ConnectionRepair weld_vertices(TriangleMesh& mesh, const std::vector<std::uint32_t>& vertices, double near_m);

/// Joins the two ends of each given edge, likewise.
ConnectionRepair weld_edges(TriangleMesh& mesh,
                            const std::vector<std::pair<std::uint32_t, std::uint32_t>>& edges);

/// Where four or more faces meet at an edge and bound solids alternately around it, the solids touch there. Each gets
/// an edge of its own: by copies of its vertices, or by a vertex in the middle of the edge where the solids are one
/// elsewhere. Edges where faces lie on one another, or do not alternate, stay.
ConnectionRepair separate_touching_edges(TriangleMesh& mesh);

}  // namespace takt
