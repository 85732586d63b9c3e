#pragma once
// GLB files (binary glTF 2.0), by assimp. Only this file's source uses assimp.
#include <string>
#include <string_view>
#include <vector>

#include "server/geometry/mesh/builder.h"

namespace takt {

/// Each node with faces is an object, in the order of the tree, named by the names from the root to it. Without
/// a name of a node all of them are read, in the axes of the file: y up is kept. With one (find_glb_node), that
/// node and those below it are read, in the frame of the node. Scales and shears of nodes are applied.
/// Coordinates have single precision (shortest_decimals). Lines and points are passed over
/// (NamedMesh::findings). Throws MeshFault.
std::vector<NamedMesh> read_glb(std::string_view content, const std::string& node = {});

}  // namespace takt
