#include "server/scenario/sdf_files.h"

#include <string_view>

#include "idl/common/parse.h"

namespace takt {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestSdf_MB = 16;
constexpr std::string_view kUrdfRoot{"robot"};

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
  const auto version = finite_number(text);
  if (!version || !text.starts_with("1."))
    file.fail(*root, "<sdf>: version: found '" + text + "'; allowed: 1.0 to 1.12");
  // 1.10 comes after 1.9.
  return text.size() > 3 ? 1.9 + 0.001 * *finite_number(text.substr(2)) : *version;
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
  for (const std::string& name : {address, "model://" + address}) {
    if (const auto config = found(name + "/model.config"))
      if (const auto named = named_in(open(*config))) return named;
    if (const auto model = found(name + "/model.sdf")) return model;
    if (const auto whole = found(name)) return whole;
    if (address.find("://") != address.npos) break;  // a name without scheme is also that of a model
  }
  return missing(file, element, uri);
}

std::optional<fs::path> SdfFiles::mesh(const XmlFile& file, const XmlFile::Element& element,
                                       const std::string& uri) {
  if (const auto found = find_mesh_file(local_address(uri), file.file(), options_.packages))
    return fs::absolute(*found).lexically_normal();
  return missing(file, element, uri);
}

}  // namespace takt
