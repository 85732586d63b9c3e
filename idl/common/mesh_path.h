#pragma once
// The name of a mesh in a scenario: a file, or FILE.glb#NODE for one node of a GLB file.
#include <filesystem>
#include <string>

namespace takt {

struct MeshPath {
  std::filesystem::path file;
  std::string node;  ///< empty: the whole file
};

/// A path that exists as it stands is a file; of any other one the first # that follows the name of an existing
/// file, else the first .glb, begins the node.
MeshPath split_mesh_path(const std::filesystem::path& mesh);

/// For messages: cell.glb#Frame/Housing, without folders.
std::string mesh_label(const std::filesystem::path& mesh);

}  // namespace takt
