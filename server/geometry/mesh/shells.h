#pragma once
// The closed shells of a mesh: pieces of surface that hang together by their edges, and which lies in which.
#include <cstdint>
#include <vector>

#include "server/geometry/aabb.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

struct Shell {
  std::vector<std::uint32_t> triangles;
  double volume_m3 = 0.0;  ///< negative if it faces inwards
  Aabb box;
  std::vector<std::size_t> around;  ///< shells that it lies in
};

/// How often the surface of the triangles winds around the point: 1 inside of a shell that faces outwards, -1
/// of one that faces inwards, 0 outside (solid angles by van Oosterom, Strackee 1983).
double winding_number(const TriangleMesh& mesh, const std::vector<std::uint32_t>& triangles,
                      const Vec3& point);

/// Every edge must have two triangles that run through it in opposite directions. In order of the first
/// triangle.
std::vector<Shell> find_shells(const TriangleMesh& mesh);

}  // namespace takt
