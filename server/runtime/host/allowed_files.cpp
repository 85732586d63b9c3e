#include "server/runtime/host/allowed_files.h"

#include <algorithm>

namespace takt {
namespace {

std::string confine(std::filesystem::path& file, const std::filesystem::path& directory) {
  std::error_code error;
  const auto root = std::filesystem::canonical(directory, error);
  if (error) return "The directory of scenarios " + directory.string() + " is not there.";
  const auto whole = std::filesystem::weakly_canonical(root / file, error);
  const auto differs = std::mismatch(root.begin(), root.end(), whole.begin(), whole.end());
  if (error || differs.first != root.end())
    return "The file '" + file.string().substr(0, 200) + "' is not below the directory of scenarios, " +
           root.string() + "; this server reads no others.";
  file = whole;
  return {};
}

/// A value that names a file elsewhere; names in scenarios are relative to the scenario.
bool leaves(const std::string& text) {
  const auto value = text.substr(std::min(text.find('=') + 1, text.size()));
  return value.find("..") != std::string::npos || value.find('/') != std::string::npos;
}

}  // namespace

std::string confine(HostAction& action, const std::filesystem::path& directory) {
  if (directory.empty()) return {};
  if (auto* spawn = std::get_if<SpawnEntity>(&action))
    return spawn->mesh.empty() ? std::string() : confine(spawn->mesh, directory);
  auto* load = std::get_if<LoadScenario>(&action);
  if (load == nullptr) return {};
  for (const std::string& text : load->options.overrides) {
    if (leaves(text))
      return "The override '" + text.substr(0, 200) +
             "' names a file in another directory; with a directory of scenarios that is not allowed.";
  }
  return confine(load->file, directory);
}

}  // namespace takt
