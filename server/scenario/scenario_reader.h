#pragma once
// Scenario files: YAML into Scenario structs. Every error is a ScenarioError with file, line, column, key,
// the value found and the values allowed.
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/fields/scenario_error.h"
#include "server/scenario/scenario.h"

namespace takt {

struct ScenarioOptions {
  /// "key=value" with a dotted key as in the file, e.g. "parts.P.mass_kg=0.4"; the value is YAML.
  std::vector<std::string> overrides;
  /// Level of detail of every process, instead of the file's.
  std::optional<int> level_of_detail;
  /// Options of a program that are overrides of a key, for error texts: "solver.method" is "--solver".
  std::map<std::string, std::string> option_of{};
  /// Read in place of the content of the file.
  std::optional<std::string> text{};
};

/// Throws the ScenarioError of a value that shows to be wrong when the cell is built.
[[noreturn]] void fail(const Scenario& scenario, const std::string& key, const std::string& found,
                       const std::string& allowed);

/// Throws ScenarioError. Relative paths in the file are relative to it.
Scenario read_scenario(const std::filesystem::path& file, const ScenarioOptions& options = {});

/// std::nullopt where the file is YAML of another kind. Throws ScenarioError.
std::optional<ScenarioHeading> read_heading(const std::filesystem::path& file);

}  // namespace takt
