#pragma once
// Mesh files that the page may read to draw the robots of a URDF. A file is served if it lies below a folder
// named on the command line of takt view and its kind is one that a page can draw. No other file is served.
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace takt::view {

/// The resolved path of the file if it exists and lies below the folder. Links are followed in both.
std::optional<std::filesystem::path> file_below(const std::filesystem::path& folder,
                                                const std::filesystem::path& file);

class RobotFiles {
 public:
  RobotFiles() = default;
  /// Throws std::filesystem::filesystem_error if a folder does not exist.
  explicit RobotFiles(const std::vector<std::filesystem::path>& folders);

  bool any() const { return !folders_.empty(); }
  /// Of an address below /files/:
  ///   relative/PATH         a file of that name in one of the folders
  ///   package/PACKAGE/PATH  package://PACKAGE/PATH, in these folders as find_mesh_file() searches them
  ///   absolute/PATH         file:///PATH, by the same function
  /// A component `(up)` of PATH means `..`, which browsers remove from addresses. Components may be
  /// percent-encoded. Empty if the file does not exist, is of another kind, or does not lie below one of the
  /// folders, links followed.
  std::optional<std::filesystem::path> find(std::string_view address) const;

 private:
  std::optional<std::filesystem::path> allowed(const std::filesystem::path& file) const;

  std::vector<std::filesystem::path> folders_;  ///< without links
};

}  // namespace takt::view
