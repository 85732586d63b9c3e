#pragma once
// The closed shells of a mesh: pieces of surface connected by edges, and the nesting of the shells.
#include <cstdint>
#include <vector>

#include "server/geometry/aabb.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

struct Shell {
  std::vector<std::uint32_t> triangles;
  double volume_m3 = 0.0;  ///< negative if it faces inwards
  Aabb box;
  std::vector<std::size_t> around;  ///< shells that contain this one
};

/// Winding number of the triangles' surface around the point: 1 inside a shell that faces outwards, -1 inside
/// one that faces inwards, 0 outside (solid angles by van Oosterom, Strackee 1983).
double winding_number(const TriangleMesh& mesh, const std::vector<std::uint32_t>& triangles,
                      const Vec3& point);

/// The shells in the order of their first triangle. Every edge must have two triangles that run through it in
/// opposite directions.
std::vector<Shell> find_shells(const TriangleMesh& mesh);

}  // namespace takt
