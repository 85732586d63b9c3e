#pragma once
// The cell of a running server: the loaded scenario, if any, and its exchange for another one.
//
//   submit() --> requests of phase host (takt_requests.idl): a thread of the host's own, one at a time
//            '-> all others: the loop of the loaded scenario; refused without one
//
// The host's thread reads and builds a scenario while the loaded one continues. After success, and the
// listener's check that it can be shown, it is exchanged: the old loop ends between two steps, the listener
// releases it, and the new one starts: stopped, at its initial state, with the pace of the old one. A
// scenario that cannot be read has no effect; the reply contains the reader's sentence.
//
// Spawning and deleting Parts is such an exchange too, by the scenario with or without them, with pace and
// registered controllers kept. As the new one begins at its initial state, the simulation must be in the
// state `stopped`.
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/runtime/host/gateways.h"
#include "server/runtime/host/host_jobs.h"
#include "server/runtime/host/host_options.h"
#include "server/runtime/host/recordings.h"
#include "server/runtime/host/scenario_slot.h"
#include "server/runtime/host/scenario_text.h"
#include "server/runtime/host/snapshots.h"
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/requests/outbound_queue.h"

namespace takt {

class CellHost {
 public:
  explicit CellHost(HostOptions options);
  ~CellHost();
  CellHost(const CellHost&) = delete;
  CellHost& operator=(const CellHost&) = delete;

  /// Call it ahead of open() and submit(); the listener must outlive the host or its stop().
  void set_listener(CellLifecycleListener* listener) { slot_.set_listener(listener); }
  /// Called once, from any thread, when a request or the end of a scenario ends the server. Set it ahead of
  /// open().
  void set_on_quit(std::function<void()> on_quit);

  /// Loads the first scenario and starts it, in the calling thread. Throws ScenarioError, MeshError,
  /// UrdfError, or an exception of the listener.
  void open(const ScenarioSource& source);
  /// The same for a cell without a file; it cannot be reloaded.
  void open(std::shared_ptr<const CellModel> model);
  /// Alternative to open(): begins without a scenario.
  void open_empty() { open_first(nullptr); }

  /// Alternative to open(), in a server that restarts after a crash: loads the scenario of the crashed run,
  /// from its newest readable periodic snapshot; without a snapshot from the initial state, without a session
  /// from `otherwise`. `crash` describes the crash. The event `restarted` reports it to all clients. Throws
  /// as open().
  void resume(const std::string& crash, const std::optional<ScenarioSource>& otherwise);

  /// Any thread. The reply comes through outbound().
  void submit(const ControlRequest& request);
  /// Any thread, while another one opens: ends the import at its next check. stop() must follow.
  void give_up() { jobs_.give_up(); }
  /// Ends the loaded loop and the host's thread, after the present import. May be called more than once.
  void stop();

  OutboundQueue& outbound() { return *outbound_; }
  const std::string& cell() const { return options_.cell; }
  /// outbound() has an announcement, which is final.
  bool announces() const { return announces_.load(); }
  /// Status while no scenario is loaded; else std::nullopt.
  std::optional<LoopStatus> idle_status() const;
  /// Those that have reported themselves lately; the end of others becomes an event.
  std::vector<requests::ReportGateway> gateways() { return gateways_.present(monotonic_now_ns()); }
  /// The loop of the loaded scenario or nullptr; valid until a request exchanges it.
  RunLoop* loop() const;
  /// What clients say about its entities; nullptr: no scenario is loaded.
  std::shared_ptr<const EntityInfos> entity_infos() const;
  /// Its simulation: to be touched only when the loop has ended.
  const Simulation* simulation() const;

 private:
  void open_first(std::shared_ptr<LoadedScenario> first);

  // Executed at once, in any thread.
  Outcome<requests::GetFeatures> execute(const requests::GetFeatures& request) const;
  Outcome<requests::GetEntities> execute(const requests::GetEntities& request) const;
  Outcome<requests::SetEntityInfo> execute(const requests::SetEntityInfo& request) const;
  Outcome<requests::ReportGateway> execute(const requests::ReportGateway& request);
  Outcome<requests::GetNamedPoses> execute(const requests::GetNamedPoses& request) const;
  Outcome<requests::GetScenario> execute(const requests::GetScenario& request) const;
  Outcome<requests::WatchPressures> execute(const requests::WatchPressures& request) const;
  // Executed in any thread while no scenario is loaded; all other requests of the loop are refused.
  Outcome<requests::GetState> execute(const requests::GetState& request) const;
  Outcome<requests::SetState> execute(const requests::SetState& request) const;
  // The host's thread.
  Outcome<requests::GetScenarios> execute(const requests::GetScenarios& request) const;
  Outcome<requests::GetSpawnables> execute(const requests::GetSpawnables& request) const;
  Outcome<requests::LoadScenario> execute(const requests::LoadScenario& request);
  Outcome<requests::ReloadScenario> execute(const requests::ReloadScenario& request);
  Outcome<requests::UnloadScenario> execute(const requests::UnloadScenario& request);
  Outcome<requests::SpawnEntity> execute(const requests::SpawnEntity& request);
  Outcome<requests::DeleteEntity> execute(const requests::DeleteEntity& request);
  Outcome<requests::SaveSnapshot> execute(const requests::SaveSnapshot& r) { return snapshots_.save(r); }
  Outcome<requests::GetScenarioText> execute(const requests::GetScenarioText&) { return text_.get(); }
  Outcome<requests::SaveScenarioText> execute(const requests::SaveScenarioText& r) { return text_.save(r); }
  Outcome<requests::GetSnapshots> execute(const requests::GetSnapshots&) { return snapshots_.list(); }
  Outcome<requests::RestoreSnapshot> execute(const requests::RestoreSnapshot& r) {
    return snapshots_.restore(r);
  }
  Outcome<requests::StartRecording> execute(const requests::StartRecording& r) {
    return recordings_.start(r);
  }
  Outcome<requests::StopRecording> execute(const requests::StopRecording&) { return recordings_.stop(); }
  /// For a scenario with spawned or deleted Parts.
  Outcome<requests::Reset> execute(const requests::Reset& request);

  ControlReply execute_job(const HostJobs::Job& job);
  void offer(std::uint64_t id, requests::Any request);
  template <Request Type>
  Outcome<Type> change(const Type& request, const char* done);
  template <Request Type>
  Outcome<Type> load(const ScenarioSource& source);
  /// Exchanges the loaded scenario for one with these changes to its file's content. Returns the generation
  /// of the description.
  std::variant<std::uint32_t, Refusal> exchange_content(const Scenario& wanted, bool any_state,
                                                        std::vector<requests::Any> changes);
  /// Exchanges the scenario. On failure returns the reason, and no scenario is loaded.
  std::optional<Refusal> try_exchange(std::shared_ptr<LoadedScenario> next,
                                      std::optional<SimulationState> state, bool keep_controllers);
  Refusal nothing_loaded() const;
  SimulationState state_without_scenario() const;

  const HostOptions options_;
  const std::shared_ptr<OutboundQueue> outbound_ = std::make_shared<OutboundQueue>();
  std::function<void()> on_quit_;
  std::atomic<bool> announces_{false};
  Gateways gateways_{outbound_->events};
  ScenarioSlot slot_;
  const ScenarioText text_;
  Snapshots snapshots_;
  Recordings recordings_;
  HostJobs jobs_;  ///< its thread uses all of the above
};

}  // namespace takt
