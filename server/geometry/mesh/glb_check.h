#pragma once
// A GLB file before assimp reads it. assimp 5.2.5 follows a count of four billion for minutes and a chain of nodes until
// the stack ends: the check admits only files for which assimp is made.
#include <cstddef>
#include <string>
#include <string_view>

namespace takt {

/// Most triangles that all nodes of a file may show together, and most nodes above a node.
inline constexpr std::size_t kMaxGlbTriangles = 20'000'000;
inline constexpr std::size_t kMaxGlbDepth = 200;

/// The file with its nodes, meshes, positions and indices alone, under the numbers they have; materials, pictures,
/// animations, skins and extensions are left out. Throws MeshFault with the place (mesh, node, accessor) of what is
/// invalid. Source: glTF 2.0, sections 3.5 to 3.7 and 4.4.
std::string checked_glb(std::string_view content);

}  // namespace takt
