#pragma once
// What CellHost has loaded: for its own .cpp files.
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "server/runtime/host/cell_host.h"
#include "server/runtime/host/snapshot_writer.h"
#include "server/simulation/step/simulation.h"

namespace takt {

struct CellHost::LoadedScenario {
  LoadedScenario(std::shared_ptr<const CellModel> model, Executor* executor, RunLoopOptions options)
      : simulation(std::move(model)), loop(prepared(simulation, executor), std::move(options)) {}
  static Simulation& prepared(Simulation& simulation, Executor* executor) {
    if (executor != nullptr) simulation.set_executor(executor);
    return simulation;
  }

  Simulation simulation;
  RunLoop loop;
  // Of what came from a file; constant once it is loaded.
  std::optional<ScenarioSource> source;
  std::optional<Scenario> as_loaded;    ///< what the file said
  std::optional<Scenario> content;      ///< with what was spawned, without what was deleted
  std::vector<ControlRequest> changes;  ///< that made the one of the other
  std::optional<SnapshotWriter> writer;
};

}  // namespace takt
