#pragma once
// The nodes of a GLB file: names, transforms, and the choice of one of them by its name.
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plant_models/spatial.h"

namespace takt {

/// Affine map of a node: glTF allows scale and shear, so this is not a Pose.
struct Affine {
  Mat3 A = Mat3::Identity();
  Vec3 p = Vec3::Zero();
  Affine operator*(const Affine& child) const { return {A * child.A, A * child.p + p}; }
  Vec3 operator*(const Vec3& x) const { return A * x + p; }
};

struct GlbNode {
  std::uint64_t number = 0;  ///< in the file
  int parent = -1;           ///< index in GlbNodes; -1: a root of the scene
  std::string name;          ///< of the node, else of its mesh, else nodes[NUMBER]
  Affine X_PN;               ///< in the parent
  std::optional<std::uint64_t> mesh;
  bool has_faces = false;  ///< its own mesh has primitives other than lines and points
};

/// The nodes of the scene, parents before children: the nodes below one follow it at once.
using GlbNodes = std::vector<GlbNode>;

/// Names from the root to the node, e.g. Cell/Frame/Housing.
std::string glb_node_path(const GlbNodes& nodes, std::size_t node);

/// End of the range of nodes that begins with `node` and has all nodes below it.
std::size_t end_of_glb_node(const GlbNodes& nodes, std::size_t node);

bool has_faces(const GlbNodes& nodes, std::size_t first, std::size_t last);

/// The range of the node of this name and of all nodes below it. The name may be the end of the path, e.g.
/// Frame/Housing. Of nodes of one name that lie below one another it is the outermost. Throws MeshFault
/// with the names that exist where no node has this name, where several have it, or where its node has no faces.
std::pair<std::size_t, std::size_t> find_glb_node(const GlbNodes& nodes, const std::string& name);

/// The node in the axes of the file.
Affine glb_node_in_file(const GlbNodes& nodes, std::size_t node);

/// A map as a pose and a remaining stretch in the axes of the pose: X = pose * stretch. The rotation is the one
/// closest to the map (polar decomposition; Higham 1986). The stretch is the identity if it is so within single
/// precision. A mirroring map keeps its mirror in the stretch, with the x axis turned round. Throws MeshFault
/// for a map that flattens, or that is not finite.
std::pair<Pose, Affine> rigid_part(const Affine& X, const std::string& name);

}  // namespace takt
