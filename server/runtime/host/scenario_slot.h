#pragma once
// The place of the one loaded scenario: builds a scenario with its simulation, and exchanges what is loaded.
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/runtime/host/host_options.h"
#include "server/runtime/host/snapshot_writer.h"
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/runtime/recording/session_store.h"
#include "server/runtime/requests/outbound_queue.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Shows to the outside what is loaded. Called by the thread of the host, or of CellHost::open().
class CellLifecycleListener {
 public:
  virtual ~CellLifecycleListener() = default;
  /// Before anything is exchanged. Throws what says, in a sentence, why this cell cannot be shown.
  virtual void check(const CellDescription& cell) = 0;
  /// A scenario is loaded; its loop has not been started and lives until closed().
  virtual void opened(RunLoop& loop) = 0;
  /// The loop has ended and will be destroyed.
  virtual void closed(RunLoop& loop) = 0;
  /// No scenario is loaded: `cell` is empty but for the names.
  virtual void idle(const CellDescription& cell) = 0;
};

struct LoadedScenario {
  explicit LoadedScenario(std::shared_ptr<const CellModel> model) : simulation(std::move(model)) {}

  Simulation simulation;
  std::optional<double> pause_at_s;
  // Of what came from a file; constant once it is loaded.
  std::optional<ScenarioSource> source;
  std::optional<Scenario> as_loaded;   ///< what the file said
  std::optional<Scenario> content;     ///< with what was spawned, without what was deleted
  std::vector<requests::Any> changes;  ///< that made the one of the other
  std::optional<RunLoop> loop;         ///< from the exchange on
  std::optional<SnapshotWriter> writer;
};

class ScenarioSlot {
 public:
  /// `given_up`: asked while a scenario is imported; true ends the import. The options outlive it.
  ScenarioSlot(const HostOptions& options, std::shared_ptr<OutboundQueue> outbound,
               std::function<bool()> given_up);

  // Before the first exchange.
  void set_listener(CellLifecycleListener* listener) { listener_ = listener; }
  void set_on_quit(std::function<void()> on_quit) { on_quit_ = std::move(on_quit); }
  /// Called in an exchange: the loop of the scenario is made but not started; null: none is loaded.
  void set_on_exchange(std::function<void(LoadedScenario*)> call) { on_exchange_ = std::move(call); }

  // One thread: that of the host, or of CellHost::open().

  /// Throw what the readers throw, or the listener.
  std::shared_ptr<LoadedScenario> build(const ScenarioSource& source);
  std::shared_ptr<LoadedScenario> build(const Scenario& scenario);
  std::shared_ptr<LoadedScenario> build(std::shared_ptr<CellModel> model, double duration_s);
  /// With everything that these requests spawn and delete, in turn.
  std::shared_ptr<LoadedScenario> build(const ScenarioSource& source, std::vector<requests::Any> changes);
  /// Ends the loop of what is loaded and starts the next; null: none. In `state`; without it a scenario that is not
  /// the first one is stopped. `keep_controllers`: those of the ended loop stay registered. Returns the
  /// generation of the description from here on.
  std::uint32_t exchange(std::shared_ptr<LoadedScenario> next,
                         std::optional<SimulationState> state = std::nullopt, bool keep_controllers = false);

  // Any thread.

  std::shared_ptr<LoadedScenario> loaded() const;
  /// Of the next loop.
  Pace pace() const;
  double pace_factor() const;
  void set_pace(Pace pace, double factor);

 private:
  const HostOptions& options_;
  const std::shared_ptr<OutboundQueue> outbound_;
  const std::function<bool()> given_up_;
  CellLifecycleListener* listener_ = nullptr;
  std::function<void()> on_quit_;
  std::function<void(LoadedScenario*)> on_exchange_;
  std::optional<WorkerPool> pool_;
  std::uint32_t generation_ = 0;  ///< exchanges so far
  mutable std::mutex mutex_;
  std::shared_ptr<LoadedScenario> loaded_;  // guarded by mutex_, as all below
  Pace pace_;
  double factor_;
};

}  // namespace takt
