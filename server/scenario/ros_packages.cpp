#include "server/scenario/ros_packages.h"

#include <array>
#include <string_view>
#include <system_error>

namespace takt {

namespace {

namespace fs = std::filesystem;

std::optional<fs::path> existing(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error) ? std::optional(file) : std::nullopt;
}

/// PACKAGE/PATH of a name that begins with a scheme of packages; empty: it does not.
std::string_view in_packages(std::string_view name) {
  for (const std::string_view scheme : {"package://", "model://"})
    if (name.starts_with(scheme)) return name.substr(scheme.size());
  return {};
}

/// A folder's own name, also for `FOLDER/` and relative paths.
fs::path own_name(const fs::path& folder) {
  std::error_code error;
  const fs::path place = fs::weakly_canonical(folder, error);
  return error ? folder.filename() : place.filename();
}

}  // namespace

std::string package_of(const std::string& name) {
  const std::string_view path = in_packages(name);
  return std::string(path.substr(0, path.find('/')));
}

std::optional<fs::path> find_mesh_file(const std::string& name, const fs::path& description,
                                       const PackageFolders& folders) {
  const std::string_view path = in_packages(name);
  const fs::path beside = description.parent_path();
  if (path.empty()) {
    constexpr std::string_view file_scheme = "file://";
    return existing(beside / (name.starts_with(file_scheme) ? name.substr(file_scheme.size()) : name));
  }
  const std::string package = package_of(name);
  const fs::path rest = path.size() > package.size() ? path.substr(package.size() + 1) : std::string_view();
  for (const fs::path& folder : folders) {
    if (own_name(folder) == package)
      if (auto file = existing(folder / rest)) return file;
    for (const fs::path& place : std::array{folder / package, folder / "share" / package})
      if (auto file = existing(place / rest)) return file;
  }
  std::error_code error;
  fs::path above = fs::absolute(description, error).lexically_normal();
  while (!error && above.has_relative_path()) {
    above = above.parent_path();
    if (above.filename() == package)
      if (auto file = existing(above / rest)) return file;
    if (auto file = existing(above / package / rest)) return file;
  }
  return std::nullopt;
}

}  // namespace takt
