#include "server/runtime/host/file_lists.h"

#include <algorithm>
#include <set>
#include <string>

#include "idl/common/eigen_messages.h"
#include "idl/common/text.h"
#include "server/runtime/host/allowed_files.h"
#include "server/scenario/scenario_reader.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

/// Entries of directories that one request looks at, so that a wrong directory does not occupy the host for long.
constexpr std::size_t kMostEntries = 20'000;

/// Files with these extensions, and the sentences about what could not be searched.
class Search {
 public:
  Search(std::vector<std::string> extensions, fs::path allowed)
      : extensions_(std::move(extensions)), allowed_(std::move(allowed)) {}

  /// A file, or a directory with those below it. Returns whether it was there.
  bool add(const std::string& source) {
    std::string uri = source;
    if (!allowed_.empty()) {
      if (std::string refused = confine(uri, allowed_); !refused.empty()) return fails(std::move(refused));
    }
    const fs::path path = file_of_uri(uri);
    std::error_code error;
    if (fs::is_regular_file(path, error) && fits(path)) return take(path);
    if (!fs::is_directory(path, error))
      return fails("'" + source.substr(0, 200) + "' is neither a directory nor a file of the kind " +
                   list_names(extensions_) + ", seen from the " +
                   (allowed_.empty() ? "working directory of the server." : "directory of scenarios."));
    return walk<fs::recursive_directory_iterator>(path);
  }
  /// Its files alone.
  bool add_flat(const fs::path& directory) { return walk<fs::directory_iterator>(directory); }

  const std::set<fs::path>& files() const { return files_; }
  const std::vector<std::string>& problems() const { return problems_; }
  void report(std::string problem) { problems_.push_back(std::move(problem)); }

 private:
  bool fails(std::string sentence) {
    problems_.push_back(std::move(sentence));
    return false;
  }
  bool fits(const fs::path& path) const { return has_extension(path, extensions_); }
  bool take(const fs::path& path) {
    std::error_code error;
    files_.insert(fs::absolute(path, error).lexically_normal());
    return true;
  }
  template <class Iterator>
  bool walk(const fs::path& directory) {
    std::error_code error;
    Iterator entry(directory, fs::directory_options::skip_permission_denied, error);
    if (error)
      return fails("The directory " + directory.string() + " cannot be read: " + error.message() + ".");
    for (; entry != Iterator(); entry.increment(error)) {
      if (++entries_ > kMostEntries)
        return fails("The directory " + directory.string() + " is not listed to its end: only " +
                     std::to_string(kMostEntries) + " entries are looked at.");
      std::error_code unknown;
      if (entry->symlink_status(unknown).type() == fs::file_type::regular && fits(entry->path()))
        take(entry->path());
    }
    return true;
  }

  std::vector<std::string> extensions_;
  fs::path allowed_;
  std::set<fs::path> files_;
  std::size_t entries_ = 0;
  std::vector<std::string> problems_;
};

std::string with_problems(std::string sentence, const std::vector<std::string>& problems) {
  for (const std::string& problem : problems) sentence += " " + problem;
  return sentence;
}

}  // namespace

bool has_extension(const fs::path& file, const std::vector<std::string>& extensions) {
  const std::string extension = lower_text(file.extension().string());
  return std::any_of(extensions.begin(), extensions.end(),
                     [&](const std::string& one) { return extension == "." + one; });
}

Outcome<requests::GetScenarios> list_scenarios(const requests::GetScenarios& request,
                                               const fs::path& directory, const fs::path& loaded) {
  Search search({"yaml", "yml"}, directory);
  bool reached = true;
  ControlResult code = ControlResult::not_found;
  if (!directory.empty() && !search.add(fs::absolute(directory).string())) {
    reached = false;
    code = ControlResult::default_sources_failed;
  }
  if (directory.empty() && !loaded.empty()) search.add_flat(loaded.parent_path());
  for (const std::string& source : request.sources) reached = search.add(source) && reached;
  if (!reached && !request.continue_on_error) return Refusal{code, search.problems().front()};

  requests::GetScenariosResponse response;
  std::vector<std::string> unreadable;
  for (const fs::path& file : search.files()) {
    try {
      if (auto heading = read_heading(file))
        response.scenarios.push_back({std::move(heading->name), file.string(),
                                      std::move(heading->description), std::move(heading->tags)});
    } catch (const ScenarioError& error) {
      unreadable.emplace_back(error.what());
    }
  }
  if (!reached && response.scenarios.empty()) return Refusal{code, search.problems().front()};
  if (!unreadable.empty())
    search.report(counted(unreadable.size(), "file", "files") + " cannot be read, first " +
                  unreadable.front());
  return {with_problems(counted(response.scenarios.size(), "scenario.", "scenarios."), search.problems()),
          std::move(response)};
}

Outcome<requests::GetSpawnables> list_spawnables(const requests::GetSpawnables& request,
                                                 const fs::path& directory, const Scenario* content,
                                                 const CellDescription& cell) {
  requests::GetSpawnablesResponse response;
  if (content != nullptr) {
    for (const ScenarioPart& part : content->parts) {
      auto& spawnable = response.spawnables.emplace_back();
      spawnable.copy_of = part.name;
      spawnable.description = "another " + part.name + ", " + number_text(part.mass_kg) + " kg, hierarchy " +
                              std::to_string(part.hierarchy);
      const int index = cell.find_component(part.name);
      if (index < 0) continue;
      if (const auto box = cell.components[static_cast<std::size_t>(index)].box()) {
        spawnable.lower = to_vector((*box)[0]);
        spawnable.upper = to_vector((*box)[1]);
      }
    }
  }
  Search search(features().spawn_formats, directory);
  for (const std::string& source : request.sources) search.add(source);
  for (const fs::path& file : search.files()) {
    auto& spawnable = response.spawnables.emplace_back();
    spawnable.uri = file.string();
    spawnable.description = "a Part of the mesh " + file.filename().string() + "; its mass is to be stated";
  }
  return {with_problems(counted(response.spawnables.size(), "spawnable.", "spawnables."), search.problems()),
          std::move(response)};
}

}  // namespace takt
