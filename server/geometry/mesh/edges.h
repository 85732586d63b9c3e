#pragma once
// The edges of a triangle mesh and the triangles that meet there.
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// One side of one triangle, the lower vertex first.
struct HalfEdge {
  std::uint32_t low;
  std::uint32_t high;
  std::uint32_t triangle;
  bool upward;  ///< the triangle runs through it from low to high
};

/// All sides of all triangles by edge, then by triangle. Vertex numbers must be in range.
std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh);

/// End of the range of half edges that begins at `begin` and shares its edge.
std::size_t end_of_edge(const std::vector<HalfEdge>& edges, std::size_t begin);

/// False if the area may be an effect of rounding: the height is below 1e-12 of the longest edge.
bool has_area(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle);

/// Describes the first vertex that is not finite or the first triangle with an invalid index; empty if none.
std::string find_bad_vertex_or_index(const TriangleMesh& mesh);

/// "vertex 3 (0.1, 0, 0.2)"
std::string vertex_text(const TriangleMesh& mesh, std::uint32_t vertex);

}  // namespace takt
