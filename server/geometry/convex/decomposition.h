#pragma once
// Decomposes a solid into convex parts by V-HACD 4 (Mammou; thesis 2.1.1, 5.4.1). Only this file's source
// uses V-HACD. It runs in the caller's thread alone, so that the same mesh gives the same parts, bit for bit.
#include <functional>
#include <string>
#include <vector>

#include "server/geometry/convex/overlap.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// Parameters of the decomposition, with their bounds.
struct DecompositionParameters {
  static constexpr int kMinHulls = 1, kMaxHulls = 1024;
  static constexpr int kMinResolution = 10'000, kMaxResolution = 10'000'000;
  static constexpr int kMinVertices = 4, kMaxVertices = 1024;

  int max_hulls = 32;
  int resolution = 400'000;        ///< number of voxels that the solid is cut into
  double max_volume_error = 0.02;  ///< in (0, 1]: a piece whose hull gains less than this share is left whole
  int max_vertices_per_hull = 64;  ///< of V-HACD's parts, before they are grown to the mesh's vertices
  bool best_plane = true;  ///< cut where the outline steps; false: always in the middle of the longest side
  bool operator==(const DecompositionParameters&) const = default;
};

/// Whether this program was built with V-HACD, and the version of the algorithm, which changes when results
/// may change.
bool decomposition_available();
std::string decomposition_version();

/// Convex parts of a closed mesh (check_closed), in B. Each has volume, they may overlap, and every vertex of
/// the mesh is in one of them (V-HACD alone ends up to a voxel before or behind the surface; the parts are
/// then grown to the vertices). Parts may reach up to about two voxels into a hollow: a voxel's edge is the
/// cube root of (volume of the bounding box / resolution). Throws std::invalid_argument when parameters are
/// out of bounds, when there is nothing left of the solid at this resolution, or when the program was built
/// without V-HACD: the text says what to do.
/// `progress` receives the finished share, from 0 to 1, never decreasing.
std::vector<ConvexShape> decompose(const TriangleMesh& solid, const DecompositionParameters& parameters,
                                   const std::function<void(double)>& progress = {});

}  // namespace takt
