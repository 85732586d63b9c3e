#include "idl/common/mesh_path.h"

#include <system_error>

namespace takt {

MeshPath split_mesh_path(const std::filesystem::path& mesh) {
  std::error_code unreadable;
  const std::string text = mesh.string();
  if (std::filesystem::exists(mesh, unreadable)) return {mesh, {}};
  for (std::size_t at = text.find('#'); at != text.npos; at = text.find('#', at + 1)) {
    const std::filesystem::path file = text.substr(0, at);
    if (std::filesystem::is_regular_file(file, unreadable)) return {file, text.substr(at + 1)};
  }
  // A file that is missing is reported by its name.
  if (const std::size_t at = text.find(".glb#"); at != text.npos)
    return {text.substr(0, at + 4), text.substr(at + 5)};
  return {mesh, {}};
}

std::string mesh_label(const std::filesystem::path& mesh) {
  const MeshPath path = split_mesh_path(mesh);
  return path.file.filename().string() + (path.node.empty() ? "" : "#" + path.node);
}

}  // namespace takt
