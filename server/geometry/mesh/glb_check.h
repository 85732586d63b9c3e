#pragma once
// Checks a GLB file for assimp. assimp 5.2.5 follows a count of four billion for minutes and a chain of nodes
// until the stack overflows; the check admits only files that assimp reads in bounded time and memory.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/geometry/mesh/glb_nodes.h"

namespace takt {

/// Largest numbers of triangles and of positions that all nodes of a file may show together, and deepest nesting of nodes.
inline constexpr std::size_t kMaxGlbTriangles = 20'000'000;
inline constexpr std::size_t kMaxGlbPositions = 3 * kMaxGlbTriangles;
inline constexpr std::size_t kMaxGlbDepth = 200;

/// A file reduced to the meshes of some of its nodes, their positions and indices; materials, pictures,
/// animations, skins and extensions are left out.
struct CheckedGlb {
  std::size_t first = 0, last = 0;  ///< range of the chosen nodes in GlbDocument::nodes()
  /// GLB: the chosen nodes with faces, side by side without transforms; a node's name is its index in nodes().
  /// Empty without faces.
  std::string bytes;
  std::size_t passed_over = 0;    ///< primitives of lines and points
  std::string first_passed_over;  ///< meshes[M].primitives[P]
};

/// What a mesh is made of, as far as the file says.
struct GlbMaterial {
  std::string name;                            ///< empty: none
  std::optional<std::array<float, 4>> colour;  ///< red, green, blue, alpha from 0 to 1, as sRGB
};

/// A GLB file of a description (JSON) and its buffer, whose length is a multiple of four (glTF 2.0, 4.4).
std::string glb_bytes(std::string json, const std::string& data);

class GlbDescription;

/// The description of a file, parsed once. All calls throw MeshFault with the place (mesh, node, accessor) of an
/// invalid value. Source: glTF 2.0, sections 3.5 to 3.7 and 4.4.
class GlbDocument {
 public:
  explicit GlbDocument(std::string content);
  ~GlbDocument();

  /// Of the file's scene.
  const GlbNodes& nodes() const;
  /// The node of this name with the nodes below it (find_glb_node); without a name, the whole scene. Checks their
  /// meshes.
  CheckedGlb checked(const std::string& node = {}) const;
  /// The node of this index alone.
  CheckedGlb checked_alone(std::size_t node) const;
  /// Of the mesh's first primitive with faces.
  GlbMaterial material_of(std::uint64_t mesh) const;

 private:
  std::unique_ptr<const GlbDescription> description_;
};

}  // namespace takt
