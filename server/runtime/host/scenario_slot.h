#pragma once
// Holder of the one loaded scenario: builds a scenario with its simulation, and exchanges the loaded one.
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
#include "server/runtime/requests/entity_infos.h"
#include "server/runtime/requests/outbound_queue.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Publishes the loaded scenario. Called by the thread of the host, or of CellHost::open().
class CellLifecycleListener {
 public:
  virtual ~CellLifecycleListener() = default;
  /// Check ahead of an exchange. Throws an exception with the reason, as a sentence, if this cell cannot be
  /// published.
  virtual void check(const CellDescription& cell) = 0;
  /// After loading; the loop has not been started and lives until closed().
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
  // Only for a scenario from a file; constant after loading.
  std::optional<ScenarioSource> source;
  std::optional<Scenario> as_loaded;   ///< content of the file
  std::optional<Scenario> content;     ///< with spawned Parts, without deleted ones
  std::vector<requests::Any> changes;  ///< from the first to the second
  /// Shared by the scenarios that spawning and deleting make of one another. Never null.
  std::shared_ptr<EntityInfos> infos = std::make_shared<EntityInfos>();
  std::optional<RunLoop> loop;  ///< from the exchange on
  std::optional<SnapshotWriter> writer;
};

class ScenarioSlot {
 public:
  /// `given_up` is called during an import; true ends it. The options must outlive the slot.
  ScenarioSlot(const HostOptions& options, std::shared_ptr<OutboundQueue> outbound,
               std::function<bool()> given_up);

  // Call these ahead of the first exchange.
  void set_listener(CellLifecycleListener* listener) { listener_ = listener; }
  void set_on_quit(std::function<void()> on_quit) { on_quit_ = std::move(on_quit); }
  /// Called in an exchange: the loop of the scenario exists but is not started; nullptr: no scenario.
  void set_on_exchange(std::function<void(LoadedScenario*)> call) { on_exchange_ = std::move(call); }

  // One thread: that of the host, or of CellHost::open().

  /// Throw the exceptions of the readers, or of the listener.
  std::shared_ptr<LoadedScenario> build(const ScenarioSource& source);
  std::shared_ptr<LoadedScenario> build(const Scenario& scenario);
  std::shared_ptr<LoadedScenario> build(std::shared_ptr<CellModel> model, double duration_s);
  /// With everything that these requests spawn and delete, in turn.
  std::shared_ptr<LoadedScenario> build(const ScenarioSource& source, std::vector<requests::Any> changes);
  /// Ends the loop of the loaded scenario and starts the next; nullptr: none. In `state`; without it a
  /// scenario that is not the first one is stopped. `keep_controllers`: those of the ended loop stay
  /// registered. Returns the generation of the new description.
  std::uint32_t exchange(std::shared_ptr<LoadedScenario> next,
                         std::optional<SimulationState> state = std::nullopt, bool keep_controllers = false);

  // Any thread.

  std::shared_ptr<LoadedScenario> loaded() const;
  /// Of the next loop.
  Pace pace() const;
  double pace_factor() const;
  void set_pace(Pace pace, double factor);

 private:
  /// Returns what was loaded.
  std::shared_ptr<LoadedScenario> set_loaded(std::shared_ptr<LoadedScenario> next);

  const HostOptions& options_;
  const std::shared_ptr<OutboundQueue> outbound_;
  const std::function<bool()> given_up_;
  CellLifecycleListener* listener_ = nullptr;
  std::function<void()> on_quit_;
  std::function<void(LoadedScenario*)> on_exchange_;
  std::optional<WorkerPool> pool_;
  std::uint32_t generation_ = 0;  ///< number of exchanges
  mutable std::mutex mutex_;
  std::shared_ptr<LoadedScenario> loaded_;  // guarded by mutex_, as all below
  Pace pace_;
  double factor_;
};

}  // namespace takt
