#pragma once
// The commands of takt-run. A declare function adds commands with their options to the command line; a command that
// runs sets `result`, the exit code of the process. Errors are thrown; the exit code is then kUsage.
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "server/scenario/scenario_reader.h"

namespace CLI {
class App;
}

namespace takt::tool {

// Exit codes.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;  ///< ended early, the replay differs, a difference counts, a bad verdict
inline constexpr int kUsage = 2;   ///< wrong arguments or scenario, unusable mesh, damaged log
inline constexpr int kNotAsserted = 3;  ///< the run reached its end and an assertion failed

/// The scenario of a command, and the values that replace those of its file. Options become overrides of the file, so
/// that one check and one error text serve both.
struct ScenarioArguments {
  std::string file;
  ScenarioOptions options;
  std::string allowed_fmus;           ///< directory; empty: scenarios with FMUs are refused
  std::vector<std::string> packages;  ///< folders, without those of the environment
  void declare(CLI::App& command);
};
/// An option that may be given several times, with one value each.
void add_repeatable(CLI::App& command, const char* option, std::vector<std::string>& values,
                    const std::string& value, const std::string& help);
void add_threads(CLI::App& command, int& threads);
/// --allow-fmus DIR.
void add_allowed_fmus(CLI::App& command, std::string& directory);
/// --packages DIR.
void add_packages(CLI::App& command, std::vector<std::string>& folders);

/// Throws std::runtime_error if the file cannot be written.
void write_file(const std::string& file, const std::function<void(std::ostream&)>& write);

void declare_run(CLI::App& app, int& result);
void declare_study(CLI::App& app, int& result);
void declare_verify(CLI::App& app, int& result);
void declare_replay(CLI::App& app, int& result);
/// export-fmu.
void declare_export(CLI::App& app, int& result);
void declare_from_sdf(CLI::App& app, int& result);
/// compare, check-mesh, write-scenario, schema, reference.
void declare_files(CLI::App& app, int& result);

}  // namespace takt::tool
