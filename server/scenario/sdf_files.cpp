#include "server/scenario/sdf_files.h"

#include <algorithm>
#include <sstream>
#include <string_view>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "idl/common/uri.h"

namespace takt {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestSdf_MB = 16;
constexpr std::string_view kUrdfRoot{"robot"};

/// The folder inside that is called so, whatever the case: caches write names of owners and models in small letters.
std::optional<fs::path> folder_called(const fs::path& folder, const std::string& name) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (lower_text(at->path().filename().string()) == lower_text(name)) found.push_back(at->path());
  if (found.empty()) return std::nullopt;
  return *std::min_element(found.begin(), found.end());
}

/// The newest of the versions of a model, which are folders that are called 1, 2, ...
std::optional<fs::path> newest_version(const fs::path& model) {
  std::optional<fs::path> newest;
  double largest = -1.0;
  std::error_code error;
  for (fs::directory_iterator at(model, error), end; !error && at != end; at.increment(error)) {
    const auto number = finite_number(at->path().filename().string());
    if (number && *number > largest) largest = *number, newest = at->path();
  }
  return newest;
}

/// Where a cache of Gazebo Fuel has what is at https://HOST/1.0/OWNER/models/NAME[/VERSION[/files/PATH]]:
/// HOST/OWNER/models/NAME/VERSION/PATH, without VERSION or with `tip` the newest.
std::optional<fs::path> in_cache(const fs::path& cache, const std::string& uri) {
  const std::size_t scheme = uri.find("://");
  if (!uri.starts_with("http") || scheme == uri.npos) return std::nullopt;
  std::vector<std::string> parts;
  std::istringstream address(without_escapes(uri.substr(scheme + 3)));
  for (std::string part; std::getline(address, part, '/');)
    if (!part.empty()) parts.push_back(part);
  constexpr std::size_t kModels = 3, kVersion = 5, kFiles = 6;
  const auto is = [&](std::size_t i, std::string_view name) { return i < parts.size() && parts[i] == name; };
  if (!is(kModels, "models") || parts.size() <= kModels + 1) return std::nullopt;
  if (std::find(parts.begin(), parts.end(), "..") != parts.end()) return std::nullopt;
  auto place = std::optional(cache / parts[0]);
  for (const std::string& name : {parts[2], parts[kModels], parts[kModels + 1]})
    if (place) place = folder_called(*place, name);
  if (!place) return std::nullopt;
  const bool newest = parts.size() <= kVersion || is(kVersion, "tip");
  place = newest ? newest_version(*place) : folder_called(*place, parts[kVersion]);
  if (place && is(kFiles, "files"))
    for (std::size_t i = kFiles + 1; i < parts.size(); ++i) *place /= parts[i];
  return place;
}

/// Where a cache of Gazebo Fuel that has this file (.../OWNER/models/NAME/VERSION/...) has what the file names
/// model://NAME/PATH: in the same version of the same model, else in the newest one of another model of its owner.
std::optional<fs::path> in_own_cache(const fs::path& file, const std::string& address) {
  const std::string name = without_escapes(package_of(address));
  constexpr std::string_view scheme = "model://";
  if (name.empty() || name == ".." || !address.starts_with(scheme)) return std::nullopt;
  const std::string path = without_escapes(address.substr(scheme.size()));
  const fs::path rest = path.size() > name.size() ? path.substr(name.size() + 1) : "";
  if (std::find(rest.begin(), rest.end(), "..") != rest.end()) return std::nullopt;
  std::error_code error;
  const fs::path whole = fs::absolute(file, error).lexically_normal();
  for (fs::path above = whole.parent_path(); !error && above.has_relative_path();
       above = above.parent_path()) {
    const fs::path model = above.parent_path();
    if (model.parent_path().filename() != "models" || !finite_number(above.filename().string())) continue;
    if (lower_text(model.filename().string()) == lower_text(name)) return above / rest;
    const auto other = folder_called(model.parent_path(), name);
    const auto newest = other ? newest_version(*other) : std::nullopt;
    return newest ? std::optional(*newest / rest) : std::nullopt;
  }
  return std::nullopt;
}

/// Addresses on servers of models as names of packages: https://HOST/1.0/OWNER/models/NAME/VERSION/files/PATH.
std::string local_address(const std::string& uri) {
  constexpr std::string_view slashes = "model:///";
  if (uri.starts_with(slashes)) return "model://" + uri.substr(slashes.size());
  if (!uri.starts_with("http://") && !uri.starts_with("https://")) return uri;
  constexpr std::string_view models = "/models/", files = "/files/";
  const std::size_t at = uri.find(models);
  if (at == uri.npos) return uri;
  const std::string rest = uri.substr(at + models.size());
  const std::string name = rest.substr(0, rest.find('/'));
  const std::size_t inside = rest.find(files);
  return "model://" + name + (inside == rest.npos ? "" : "/" + rest.substr(inside + files.size()));
}

/// The model:// address of a relative path (PATH, file://PATH), which the folders of models are searched for, too. Empty: the
/// path is absolute, or the address has another scheme.
std::string name_of_model(const std::string& address) {
  constexpr std::string_view scheme = "file://";
  const std::string path = address.starts_with(scheme) ? address.substr(scheme.size()) : address;
  return path.empty() || path.front() == '/' || path.find("://") != path.npos ? "" : "model://" + path;
}

/// The newest SDFormat file that a model.config names.
std::optional<fs::path> named_in(const XmlFile& config) {
  std::string name;
  double newest = -1.0;
  if (config.root() == nullptr) return std::nullopt;
  XmlFile::for_each(*config.root(), "sdf", [&](const XmlFile::Element& element) {
    const double version = finite_number(config.attribute(element, "version")).value_or(0.0);
    if (version <= newest || version >= 2.0) return;
    newest = version, name = XmlFile::content(element);
  });
  if (name.empty()) return std::nullopt;
  const fs::path file = config.file().parent_path() / name;
  std::error_code error;
  return fs::is_regular_file(file, error) ? std::optional(file) : std::nullopt;
}

}  // namespace

const XmlFile& SdfFiles::open(const fs::path& file) {
  for (const auto& open : files_)
    if (open->file() == file) return *open;
  files_.push_back(std::make_unique<XmlFile>(file, kLargestSdf_MB));
  return *files_.back();
}

double SdfFiles::version(const XmlFile& file) {
  const XmlFile::Element* root = file.root();
  if (root == nullptr) file.fail(0, "found no element <sdf>");
  const std::string name = XmlFile::name(*root);
  if (name == kUrdfRoot)
    file.fail(
        *root,
        "found <robot>: a URDF file, which a scenario names as it is (urdf of a robot); allowed: <sdf>");
  if (name != "sdf") file.fail(*root, "found <" + name + "> as the root element; allowed: <sdf>");
  const std::string text = file.require(*root, "version", "<sdf>");
  const std::string minor = text.starts_with("1.") ? text.substr(2) : "";
  if (minor.empty() || minor.size() > 2 || minor.find_first_not_of("0123456789") != minor.npos)
    file.fail(*root, "<sdf>: version: found '" + text + "'; allowed: 1.0 to 1.12");
  // 1.10 comes after 1.9.
  return minor.size() == 1 ? *finite_number(text) : 1.9 + 0.001 * *finite_number(minor);
}

std::optional<fs::path> SdfFiles::missing(const XmlFile& file, const XmlFile::Element& element,
                                          const std::string& uri) {
  const std::string found = "<" + XmlFile::name(element) + ">: found '" + uri + "', which is not there";
  if (options_.leave_out_missing) {
    note(file, element, found + "; left out");
    return std::nullopt;
  }
  const std::string package = package_of(local_address(uri));
  file.fail(element, found + "; allowed: " +
                         (package.empty() ? "a file beside this one"
                                          : "a model '" + package +
                                                "' in the folders of --packages or GZ_SIM_RESOURCE_PATH, or "
                                                "--leave-out-missing"));
}

std::optional<fs::path> SdfFiles::model(const XmlFile& file, const XmlFile::Element& element,
                                        const std::string& uri) {
  const std::string address = local_address(uri);
  const auto found = [&](const std::string& name) {
    return find_mesh_file(name, file.file(), options_.packages);
  };
  std::vector<std::string> names;
  for (const fs::path& folder : options_.packages)
    if (const auto cached = in_cache(folder, uri)) names.push_back(fs::absolute(*cached).string());
  if (const auto cached = in_own_cache(file.file(), address)) names.push_back(cached->string());
  names.push_back(address);
  if (const std::string name = name_of_model(address); !name.empty()) names.push_back(name);
  for (const std::string& name : names) {
    if (const auto config = found(name + "/model.config"))
      if (const auto named = named_in(open(*config))) return named;
    if (const auto model = found(name + "/model.sdf")) return model;
    if (const auto whole = found(name)) return whole;
  }
  return missing(file, element, uri);
}

std::optional<fs::path> SdfFiles::mesh(const XmlFile& file, const XmlFile::Element& element,
                                       const std::string& uri) {
  std::error_code error;
  for (const fs::path& folder : options_.packages)
    if (const auto cached = in_cache(folder, uri); cached && fs::is_regular_file(*cached, error))
      return fs::absolute(*cached).lexically_normal();
  const std::string address = local_address(uri);
  if (const auto cached = in_own_cache(file.file(), address); cached && fs::is_regular_file(*cached, error))
    return cached;
  for (const std::string& name : {address, name_of_model(address)})
    if (const auto found = find_mesh_file(name, file.file(), options_.packages))
      return fs::absolute(*found).lexically_normal();
  return missing(file, element, uri);
}

}  // namespace takt
