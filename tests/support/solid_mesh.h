#pragma once
#include "config/meshes/generator/solid.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::test {

/// A solid of the mesh generator as the server has it.
inline TriangleMesh mesh_of(const meshes::Solid& solid) {
  return {solid.vertices, solid.triangles};
}

}  // namespace takt::test
