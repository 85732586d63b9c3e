#pragma once
// GLB files (binary glTF 2.0), by assimp. Only this file's source uses assimp.
#include <string_view>
#include <vector>

#include "server/geometry/mesh/builder.h"

namespace takt {

/// Each node with a mesh is an object, in the order of the tree, with the transforms of the nodes applied.
/// The axes are those of the file: y up is kept. Coordinates have single precision (shortest_decimals).
/// Throws MeshFault.
std::vector<NamedMesh> read_glb(std::string_view content);

}  // namespace takt
