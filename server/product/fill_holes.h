#pragma once
// Closes the gaps that a mesher leaves in the surface of a solid.
#include <cstddef>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::product {

struct FilledMesh {
  TriangleMesh mesh;       ///< the given triangles, then those that close the holes
  std::size_t holes = 0;   ///< closed
  double largest_m = 0.0;  ///< diagonal of the box around the largest of them
};

/// Sides of triangles that no side of another triangle runs through in the opposite direction.
std::size_t open_edges(const TriangleMesh& mesh);

/// Adds to each loop of open edges the triangles of least total area (Barequet and Sharir 1995), whose time grows with
/// the third power of the length of the loop. Loops of more than 800 edges stay open.
FilledMesh fill_holes(const TriangleMesh& mesh);

}  // namespace takt::product
