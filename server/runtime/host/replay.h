#pragma once
// Simulates a recording (command_log.h) again and compares it with the recording at every checkpoint.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "idl/common/ros_packages.h"
#include "server/runtime/recording/command_log.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

class Executor;
class FmuOpener;

struct ReplayOptions {
  /// Makes the model of the recorded scenario. Throws with a sentence. See load_logged_scenario().
  std::function<std::shared_ptr<const CellModel>(const LogScenario&)> load;
  Executor* executor = nullptr;  ///< for the collision checks
};

/// Reads the scenario named in the log, or `instead` of its file, with overrides, level of detail, and
/// spawned and deleted Parts. `fmus`, `packages`: as ImportOptions has them.
std::shared_ptr<const CellModel> load_logged_scenario(const LogScenario& scenario,
                                                      const std::filesystem::path& cache_directory,
                                                      const std::filesystem::path& instead = {},
                                                      FmuOpener* fmus = nullptr,
                                                      const PackageFolders& packages = {});

struct ReplayResult {
  std::string version, cell;  ///< of the server that recorded
  std::uint64_t scenarios = 0, steps = 0, commands = 0, requests = 0, checkpoints = 0;
  /// Scenario at the last equal checkpoint.
  std::string scenario;
  std::uint64_t step = 0, state_hash = 0;
  bool complete = false;  ///< the log was ended in order
  /// Where the replay differs first, as a sentence; empty: nowhere.
  std::string difference;
  std::uint64_t different_step = 0;  ///< the step after which states differ first
  /// Why the log ends early, as a sentence; empty: it does not.
  std::string early_end;
};

/// Throws LogError for a log that cannot be read, has no checkpoint or does not fit the scenario, and the
/// exceptions of load().
ReplayResult replay(const std::filesystem::path& log, const ReplayOptions& options);

}  // namespace takt
