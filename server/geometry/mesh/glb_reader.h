#pragma once
// GLB files (binary glTF 2.0), by assimp. Only this file's source uses assimp.
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/mesh/builder.h"
#include "server/geometry/mesh/glb_check.h"

namespace takt {

/// One file, its description parsed once. All calls throw MeshFault with the place (mesh, node, accessor) of an
/// invalid value; meshes are checked where they are asked for.
class GlbFile {
 public:
  explicit GlbFile(std::string content) : document_(std::move(content)) {}

  /// Of the file's scene.
  const GlbNodes& nodes() const { return document_.nodes(); }

  /// Each node with faces is an object, in the order of the tree, named by the names from the root to it. Without a
  /// name of a node all of them are read, in the axes of the file: y up is kept. With one (find_glb_node), that node
  /// and those below it are read, in the frame of the node. Scales and shears of nodes are applied. Coordinates have
  /// single precision (shortest_decimals). Lines and points are passed over (NamedMesh::findings).
  std::vector<NamedMesh> objects(const std::string& node = {}) const;

  /// The mesh of one node (index in nodes()) without those below it, in its own frame, stretched by X. Without faces
  /// it has no triangles.
  NamedMesh own_object(std::size_t node, const Affine& X) const;
  /// Of a mesh of the file (GlbNode::mesh).
  GlbMaterial material_of(std::uint64_t mesh) const { return document_.material_of(mesh); }

 private:
  GlbDocument document_;
};

}  // namespace takt
