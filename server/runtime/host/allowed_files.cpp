#include "server/runtime/host/allowed_files.h"

#include <algorithm>

namespace takt {
namespace {

std::string confine(std::string& uri, const std::filesystem::path& directory) {
  const std::filesystem::path file = file_of_uri(uri);
  std::error_code error;
  const auto root = std::filesystem::canonical(directory, error);
  if (error) return "The directory of scenarios " + directory.string() + " is not there.";
  const auto whole = std::filesystem::weakly_canonical(root / file, error);
  const auto differs = std::mismatch(root.begin(), root.end(), whole.begin(), whole.end());
  if (error || differs.first != root.end())
    return "The file '" + file.string().substr(0, 200) + "' is not below the directory of scenarios, " +
           root.string() + "; this server reads no others.";
  uri = whole.string();
  return {};
}

/// A value that names a file elsewhere; names in scenarios are relative to the scenario.
bool leaves(const std::string& text) {
  const auto value = text.substr(std::min(text.find('=') + 1, text.size()));
  return value.find("..") != std::string::npos || value.find('/') != std::string::npos;
}

}  // namespace

std::string confine(requests::Any& request, const std::filesystem::path& directory) {
  if (directory.empty()) return {};
  if (auto* spawn = std::get_if<requests::SpawnEntity>(&request))
    return spawn->uri ? confine(*spawn->uri, directory) : std::string();
  auto* load = std::get_if<requests::LoadScenario>(&request);
  if (load == nullptr) return {};
  for (const std::string& text : load->overrides) {
    if (leaves(text))
      return "The override '" + text.substr(0, 200) +
             "' names a file in another directory; with a directory of scenarios that is not allowed.";
  }
  return confine(load->uri, directory);
}

std::filesystem::path file_of_uri(std::string uri) {
  constexpr std::string_view kScheme = "file://";
  if (uri.starts_with(kScheme)) uri.erase(0, kScheme.size());
  return uri;
}

}  // namespace takt
