#pragma once
// Mesh files that the page may have, to draw robots as their URDF says: those below folders that whoever
// starts takt view has named, and of kinds that a page can draw. Nothing else of the machine is given away.
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace takt::view {

/// The file, links followed, if there is one and it is below the folder, links followed too.
std::optional<std::filesystem::path> file_below(const std::filesystem::path& folder,
                                                const std::filesystem::path& file);

class RobotFiles {
 public:
  RobotFiles() = default;
  /// Throws std::filesystem::filesystem_error for a folder that is not there.
  explicit RobotFiles(const std::vector<std::filesystem::path>& folders);

  bool any() const { return !folders_.empty(); }
  /// Of an address below /files/:
  ///   relative/PATH         a file of that name in one of the folders
  ///   package/PACKAGE/PATH  package://PACKAGE/PATH: FOLDER/PACKAGE/PATH, or PATH in a folder called PACKAGE
  ///   absolute/PATH         /PATH
  /// A part (up) of PATH means `..`, which browsers would take away; parts may be percent-encoded. Nothing
  /// for a file that is not there, of another kind, or not below one of the folders, links followed.
  std::optional<std::filesystem::path> find(std::string_view address) const;

 private:
  std::optional<std::filesystem::path> allowed(const std::filesystem::path& file) const;

  std::vector<std::filesystem::path> folders_;  ///< without links
};

}  // namespace takt::view
