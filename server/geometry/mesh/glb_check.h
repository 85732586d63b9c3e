#pragma once
// Checks a GLB file for assimp. assimp 5.2.5 follows a count of four billion for minutes and a chain of nodes
// until the stack overflows; the check admits only files that assimp reads in bounded time and memory.
#include <cstddef>
#include <string>
#include <string_view>

namespace takt {

/// Largest number of triangles that all nodes of a file may show together, and deepest nesting of nodes.
inline constexpr std::size_t kMaxGlbTriangles = 20'000'000;
inline constexpr std::size_t kMaxGlbDepth = 200;

/// The file reduced to its nodes, meshes, positions and indices, under their original numbers; materials,
/// pictures, animations, skins and extensions are left out. Throws MeshFault with the place (mesh, node,
/// accessor) of an invalid value. Source: glTF 2.0, sections 3.5 to 3.7 and 4.4.
std::string checked_glb(std::string_view content);

}  // namespace takt
