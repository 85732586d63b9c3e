#include "idl/common/ros_packages.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>

#include "idl/common/bounded_file.h"
#include "idl/common/uri.h"

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

constexpr std::size_t kLargestManifest_MB = 1;
constexpr int kLevels = 2;  ///< of folders of packages: a workspace's `src`, a repository in it

/// The name that the package.xml of a folder states; empty: it has none. A repository is seldom called as its package.
std::string stated_name(const fs::path& folder) {
  if (!existing(folder / "package.xml")) return {};
  const std::string text = read_bounded_file(folder / "package.xml", kLargestManifest_MB).text;
  constexpr std::string_view begin = "<name>", end = "</name>", space = " \t\r\n";
  const std::size_t at = text.find(begin);
  if (at == text.npos) return {};
  const std::size_t from = text.find_first_not_of(space, at + begin.size()), to = text.find(end, at);
  if (to == text.npos || from >= to) return {};
  const std::string name = text.substr(from, to - from);
  return name.substr(0, name.find_last_not_of(space) + 1);
}

/// PATH in a package below the folder that is called otherwise than its folder.
std::optional<fs::path> find_below(const fs::path& folder, const std::string& package, const fs::path& rest,
                                   int levels) {
  std::vector<fs::path> inside;
  std::error_code error;
  for (fs::directory_iterator at(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && at != end; at.increment(error)) {
    std::error_code unknown;
    if (at->path().filename().string().front() != '.' && at->is_directory(unknown))
      inside.push_back(at->path());
  }
  std::sort(inside.begin(), inside.end());
  for (const fs::path& one : inside)
    if (stated_name(one) == package)
      if (auto file = existing(one / rest)) return file;
  for (const fs::path& one : inside)
    if (levels > 1 && !existing(one / "package.xml"))
      if (auto file = find_below(one, package, rest, levels - 1)) return file;
  return std::nullopt;
}

std::optional<fs::path> find_as_it_is(const std::string& name, const fs::path& description,
                                      const PackageFolders& folders);

}  // namespace

std::string package_of(const std::string& name) {
  const std::string_view path = in_packages(name);
  return std::string(path.substr(0, path.find('/')));
}

std::optional<fs::path> find_mesh_file(const std::string& name, const fs::path& description,
                                       const PackageFolders& folders) {
  if (auto file = find_as_it_is(name, description, folders)) return file;
  const std::string plain = without_escapes(name);
  return plain == name ? std::nullopt : find_as_it_is(plain, description, folders);
}

namespace {

std::optional<fs::path> find_as_it_is(const std::string& name, const fs::path& description,
                                      const PackageFolders& folders) {
  const std::string_view path = in_packages(name);
  const fs::path beside = description.parent_path();
  if (path.empty()) {
    constexpr std::string_view file_scheme = "file://", installed = "/share/";
    if (!name.starts_with(file_scheme)) return existing(beside / name);
    if (auto file = existing(beside / name.substr(file_scheme.size()))) return file;
    // xacro writes the places of the machine that it ran on: PREFIX/share/PACKAGE/PATH.
    const std::size_t share = name.rfind(installed);
    if (share == name.npos) return std::nullopt;
    return find_as_it_is("package://" + name.substr(share + installed.size()), description, folders);
  }
  const std::string package = package_of(name);
  if (package.empty()) return std::nullopt;
  const fs::path rest = path.size() > package.size() ? path.substr(package.size() + 1) : std::string_view();
  for (const fs::path& folder : folders) {
    if (own_name(folder) == package || stated_name(folder) == package)
      if (auto file = existing(folder / rest)) return file;
    for (const fs::path& place : std::array{folder / package, folder / "share" / package})
      if (auto file = existing(place / rest)) return file;
    if (auto file = find_below(folder, package, rest, kLevels)) return file;
  }
  std::error_code error;
  fs::path above = fs::absolute(description, error).lexically_normal();
  bool beside_package = false;  // the folder that holds the package of the description
  while (!error && above.has_relative_path()) {
    above = above.parent_path();
    if (above.filename() == package || stated_name(above) == package)
      if (auto file = existing(above / rest)) return file;
    if (auto file = existing(above / package / rest)) return file;
    if (beside_package)
      if (auto file = find_below(above, package, rest, 1)) return file;
    beside_package = existing(above / "package.xml").has_value();
  }
  return std::nullopt;
}

}  // namespace

}  // namespace takt
