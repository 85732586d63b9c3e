#pragma once
// GLB files (binary glTF 2.0): the meshes of nodes, with positions and indices; materials, pictures, animations, skins
// and extensions are passed over. Source: glTF 2.0, sections 3.5 to 3.7 and 4.4.
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "server/geometry/mesh/builder.h"
#include "server/geometry/mesh/glb_nodes.h"

namespace takt {

/// Largest number of triangles that the nodes asked for may show together, and deepest nesting of nodes.
inline constexpr std::size_t kMaxGlbTriangles = 20'000'000;
inline constexpr std::size_t kMaxGlbDepth = 200;

/// One file, understood once. All calls throw MeshFault with the place (mesh, node, accessor) of an invalid value;
/// meshes are checked where they are asked for.
class GlbFile {
 public:
  explicit GlbFile(std::string content);
  ~GlbFile();

  /// Of the file's scene.
  const GlbNodes& nodes() const;

  /// Each node with faces is an object, in the order of the tree, named by the names from the root to it. Without a
  /// name of a node all of them are read, in the axes of the file: y up is kept. With one (find_glb_node), that node
  /// and those below it are read, in the frame of the node. Scales and shears of nodes are applied. Coordinates have
  /// single precision (shortest_decimals). Lines and points are passed over (NamedMesh::findings).
  std::vector<NamedMesh> objects(const std::string& node = {}) const;

 private:
  class Content;
  std::unique_ptr<const Content> content_;
};

}  // namespace takt
