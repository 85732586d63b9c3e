#pragma once
// The edges of a triangle mesh: which triangles meet where.
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

/// Where the edge that begins at `begin` ends in such a list.
std::size_t end_of_edge(const std::vector<HalfEdge>& edges, std::size_t begin);

/// False where rounding of the coordinates could fake what area there is: the height is below 1e-12 of the
/// longest edge.
bool has_area(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle);

/// Empty, or what is wrong with the first vertex that is not finite, or triangle that refers to none.
std::string find_bad_vertex_or_index(const TriangleMesh& mesh);

/// "vertex 3 (0.1, 0, 0.2)"
std::string vertex_text(const TriangleMesh& mesh, std::uint32_t vertex);

}  // namespace takt
