#pragma once
// Division of a mesh's triangles down to a stated edge length, for surface contact (thesis 2.2.2: the
// elements must be small against the contact area).
#include <cstddef>
#include <optional>

#include "server/geometry/aabb.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

struct RefinementOptions {
  double edge_m = 0.0;  ///< > 0; upper limit of all edges of the result
  /// In the mesh's own frame: only triangles whose bounding box touches it are divided.
  std::optional<Aabb> region;
  /// A larger result is refused: a guard against a wrong unit of edge_m.
  std::size_t max_triangles = 5'000'000;
};

/// The same surface with more triangles: edges that are too long are halved, the longest first, and always
/// where they are the longest of both their triangles, so that no T-junction appears, a closed mesh stays
/// closed and no angle becomes smaller than half the smallest of its original triangle (Rosenberg, Stenger
/// 1975; Rivara 1984). Original vertices keep number and place; new ones lie on their edge to rounding, so
/// area and volume stay. Outside the region triangles are divided only as far as that demands. Same mesh,
/// same bits.
///
/// Throws std::invalid_argument if edge_m is not positive, an edge has more than two triangles, a triangle
/// names one vertex twice or one that is not there, or max_triangles would be exceeded.
TriangleMesh refine_to_edge(const TriangleMesh& mesh, const RefinementOptions& options);
TriangleMesh refine_to_edge(const TriangleMesh& mesh, double edge_m);

/// Longest edge (m); 0 without triangles.
double longest_edge(const TriangleMesh& mesh);

}  // namespace takt
