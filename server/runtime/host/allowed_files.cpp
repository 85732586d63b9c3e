#include "server/runtime/host/allowed_files.h"

#include <algorithm>
#include <functional>
#include <set>
#include <vector>

#include "idl/common/mesh_path.h"
#include "server/fields/field_value.h"

namespace takt {
namespace {

constexpr std::size_t kLongestName_bytes = 255, kMostValues = 100'000;

bool is_below(const std::filesystem::path& root, const std::filesystem::path& file) {
  std::error_code error, no_root;
  const auto top = std::filesystem::canonical(root, no_root),
             whole = std::filesystem::weakly_canonical(file, error);
  return !error && !no_root &&
         std::mismatch(top.begin(), top.end(), whole.begin(), whole.end()).first == top.end();
}

/// A name that leads out of the directory of a scenario, by itself or by a symbolic link there.
bool name_leaves(const std::string& name, const std::filesystem::path& scenarios,
                 const std::filesystem::path& beside) {
  if (name.find("..") != std::string::npos || name.find('/') != std::string::npos) return true;
  if (name.size() > kLongestName_bytes) return false;
  std::error_code error;
  const std::filesystem::path file = split_mesh_path(beside / name).file;
  return std::filesystem::exists(file, error) && !is_below(scenarios, file);
}

/// Whether `found` holds for one of the texts in the value, or there are too many.
bool any_text(const YAML::Node& value, const std::function<bool(const std::string&)>& found) {
  std::vector<YAML::Node> pending{value};
  for (std::size_t looked = 0; !pending.empty(); ++looked) {
    if (looked > kMostValues) return true;  // aliases of aliases, or a list of the same
    const YAML::Node node = pending.back();
    pending.pop_back();
    if (node.IsScalar() && found(node.Scalar())) return true;
    for (const auto& entry : node) {
      if (pending.size() > kMostValues) return true;
      if (node.IsMap()) {
        pending.push_back(entry.first);
        pending.push_back(entry.second);
      } else {
        pending.push_back(entry);
      }
    }
  }
  return false;
}

/// A value that names a file elsewhere; names in scenarios are relative to the scenario. The value is read as the
/// scenario is: in YAML "\x2f" is a slash.
bool value_leaves(const YAML::Node& value, const std::filesystem::path& scenarios,
                  const std::filesystem::path& beside) {
  return any_text(value, [&](const std::string& name) { return name_leaves(name, scenarios, beside); });
}

/// An override without a readable value is refused where it is applied.
bool override_leaves(const std::string& text, const std::filesystem::path& scenarios,
                     const std::filesystem::path& scenario) {
  try {
    return value_leaves(parse_yaml(text.substr(std::min(text.find('=') + 1, text.size()))), scenarios,
                        scenario.parent_path());
  } catch (const YAML::Exception&) {
    return false;
  }
}

/// Reading a pipe or a device may wait or continue for ever, and one file is read at a time.
std::string regular(const std::string& uri) {
  const std::filesystem::path file = file_of_uri(uri);
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status) ||
      std::filesystem::is_directory(status))
    return {};  // the reader has a sentence for both
  return "The file '" + file.string().substr(0, 200) +
         "' is no regular file; the server reads no pipes and devices.";
}

}  // namespace

std::string confine(std::string& uri, const std::filesystem::path& directory) {
  const std::filesystem::path file = file_of_uri(uri);
  std::error_code error;
  const auto root = std::filesystem::canonical(directory, error);
  if (error) return "The directory of scenarios " + directory.string() + " is not there.";
  // The node of a mesh is no part of the name of the file, which may be a symbolic link.
  const MeshPath mesh = split_mesh_path(root / file);
  const auto whole = std::filesystem::weakly_canonical(mesh.file, error);
  const auto differs = std::mismatch(root.begin(), root.end(), whole.begin(), whole.end());
  if (error || differs.first != root.end())
    return "The file '" + file.string().substr(0, 200) + "' is not below the directory of scenarios, " +
           root.string() + "; this server reads no others.";
  uri = whole.string() + (mesh.node.empty() ? "" : "#" + mesh.node);
  return {};
}

std::string confine(requests::Any& request, const std::filesystem::path& directory) {
  auto* load = std::get_if<requests::LoadScenario>(&request);
  std::string* uri = load != nullptr ? &load->uri : nullptr;
  if (auto* spawn = std::get_if<requests::SpawnEntity>(&request); spawn != nullptr && spawn->uri)
    uri = &*spawn->uri;
  if (uri == nullptr) return {};
  if (!directory.empty()) {
    if (std::string refused = confine(*uri, directory); !refused.empty()) return refused;
    if (load != nullptr) {
      for (const std::string& text : load->overrides) {
        if (override_leaves(text, directory, load->uri))
          return "The override '" + text.substr(0, 200) +
                 "' names a file in another directory; with a directory of scenarios that is not allowed.";
      }
    }
  }
  return regular(*uri);
}

std::string confine_text(const std::string& text, const std::filesystem::path& directory,
                         const std::filesystem::path& scenario) {
  if (directory.empty()) return {};
  std::set<std::string> before;
  try {
    (void)any_text(load_yaml(scenario), [&](const std::string& name) { return before.insert(name), false; });
  } catch (const ScenarioError&) {  // a file that cannot be read names none
  }
  std::string elsewhere;
  const auto leaves = [&](const std::string& name) {
    const std::filesystem::path file = scenario.parent_path() / name;
    const auto too_long = [](const auto& level) { return level.native().size() > kLongestName_bytes; };
    if (before.contains(name) || std::any_of(file.begin(), file.end(), too_long)) return false;
    std::error_code none;
    const bool names_file = name.find('/') != std::string::npos || name.find("..") != std::string::npos ||
                            std::filesystem::exists(file, none);
    if (!names_file || is_below(directory, file)) return false;
    elsewhere = name;
    return true;
  };
  try {
    if (any_text(parse_yaml(text), leaves))
      return "The text names the file '" + elsewhere.substr(0, 200) +
             "', which is not below the directory of scenarios and which the scenario did not name so far.";
  } catch (const YAML::Exception&) {  // the reader has the sentence
  }
  return {};
}

std::filesystem::path file_of_uri(std::string uri) {
  constexpr std::string_view kScheme = "file://";
  if (uri.starts_with(kScheme)) uri.erase(0, kScheme.size());
  return uri;
}

}  // namespace takt
