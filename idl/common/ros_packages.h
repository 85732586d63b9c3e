#pragma once
// Files that robot descriptions name by ROS package: package://PACKAGE/PATH, or model://MODEL/PATH.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace takt {

/// Folders in which packages are searched, each of them one of these: the package itself; a folder of packages or of
/// repositories of packages (a workspace's `src`); a prefix with packages below `share` (an entry of AMENT_PREFIX_PATH).
/// A package is called as its folder, or as its package.xml states.
using PackageFolders = std::vector<std::filesystem::path>;

/// The existing file that `name`, the file name of a mesh in `description`, stands for:
///   package://PACKAGE/PATH, model://PACKAGE/PATH  in `folders`, in their order; else, for a description that lies in a
///                   package or beside it, in the folders above the description, from the nearest on
///   file:///PATH    that path; where there is no such file, PACKAGE/PATH behind the last /share/ of it, as a package
///   PATH            relative to the description, or absolute
/// Without a description (empty), `folders` alone are searched.
std::optional<std::filesystem::path> find_mesh_file(const std::string& name,
                                                    const std::filesystem::path& description,
                                                    const PackageFolders& folders);

/// The package of such a name; empty: it names none.
std::string package_of(const std::string& name);

}  // namespace takt
