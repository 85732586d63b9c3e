#pragma once
// A GLB file before assimp sees it: what a mesh is made of is checked, and all else is left out (materials,
// pictures, animations, skins, extensions), so that a reader written for files that are as they should be
// gets only such.
#include <string>
#include <string_view>

namespace takt {

/// Most triangles that all nodes of a file may show together, and most nodes above a node.
inline constexpr std::size_t kMaxGlbTriangles = 20'000'000;
inline constexpr std::size_t kDeepestGlbNode = 200;

struct CheckedGlb {
  std::string fault;    ///< with its place in the file (mesh, node, accessor); empty: none
  std::string content;  ///< a GLB file of nodes, meshes and their positions and indices alone; their numbers
                        ///< are those of the file
};

/// `content`: with a header whose length is that of the file. Source: glTF 2.0, sections 3.5 to 3.7 and 4.4.
CheckedGlb check_glb(std::string_view content);

}  // namespace takt
