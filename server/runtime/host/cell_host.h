#pragma once
// The cell of a running server: which scenario is loaded, if any, and its exchange for another one.
//
//   submit() --> requests of the host (host_requests.h): a thread of the host's own, one at a time
//            '-> all others: the loop of the loaded scenario; refused while there is none
//
// A scenario is read and built in the host's thread while the loaded one goes on. Only when that succeeded,
// and the observer can show it outside, is it exchanged: the old loop ends between two steps, the observer
// lets go of it, and the new one starts: stopped, at its initial state, with the pace of the old one. What
// cannot be read changes nothing and is answered with the sentence of the reader.
//
// Spawning and deleting Parts is such an exchange too, by the scenario with or without them, with pace and
// registered controllers kept. As the new one begins at its initial state, the simulation must be stopped,
// which is that state.
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/runtime/host/scenario_edit.h"
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/runtime/recording/command_log.h"
#include "server/runtime/recording/session_store.h"
#include "server/runtime/requests/host_requests.h"
#include "server/runtime/requests/outbound_queue.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Shows to the outside what is loaded. Called by the thread of the host, or of open().
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

struct HostOptions {
  std::string cell = "cell";  ///< name of the server
  /// Of every loop; start_paused concerns the first one only, and pause_at_s is set by the next one below.
  RunLoopOptions loop{};
  bool end_at_duration = false;             ///< pause when the scenario's duration has been simulated
  int threads = 1;                          ///< for the collision checks
  std::filesystem::path snapshots{};        ///< directory of snapshots; empty: none are kept
  std::filesystem::path log{};              ///< file to record to from the start; empty: none
  std::filesystem::path recordings{};       ///< directory of recordings by request; empty: none are possible
  std::filesystem::path scenarios{};        ///< the files that clients may name; empty: any (allowed_files.h)
  std::string version{};                    ///< of the server, for recordings
  std::filesystem::path cache_directory{};  ///< of convex decompositions; empty: none is kept
  /// Called with what a person must be told about imported meshes and robots, by the thread that reads them;
  /// it goes out as an event too.
  std::function<void(const std::string& sentence)> on_note{};
  /// Called by the same thread while an import takes long: component, and how much of it is done, 0 to 1.
  std::function<void(const std::string& component, double part)> on_import{};
};

class CellHost {
 public:
  explicit CellHost(HostOptions options);
  ~CellHost();
  CellHost(const CellHost&) = delete;
  CellHost& operator=(const CellHost&) = delete;

  /// Before the first open() or submit(); must outlive the host or its stop().
  void set_observer(CellLifecycleListener* observer);
  /// Called once, from any thread, when a request or the end of a scenario ends the server. Set it before
  /// open().
  void set_on_quit(std::function<void()> on_quit) { on_quit_ = std::move(on_quit); }

  /// Loads the first scenario and starts it, in the calling thread. Throws ScenarioError, MeshError,
  /// UrdfError, or what the observer throws.
  void open(const ScenarioSource& source);
  /// The same for a cell that comes from no file; it cannot be reloaded.
  void open(std::shared_ptr<const CellModel> model);
  /// Instead: begins without a scenario.
  void open_empty();

  /// Instead, in a server that has crashed and starts again: what the one before had loaded, from its newest
  /// periodic snapshot that can be read; without any from the initial state, without a session from
  /// `otherwise`. `crash` says what happened. Everybody who listens is told (event `restarted`). Throws as
  /// open().
  void resume(const std::string& crash, const std::optional<ScenarioSource>& otherwise);

  /// Any thread. The reply comes through outbound().
  void submit(const ControlRequest& request);
  /// Any thread, while another one opens: the import ends as soon as it looks. stop() has to follow.
  void give_up();
  /// Ends the loaded loop and the host's thread; what is being read is read to its end before. May be called
  /// more than once.
  void stop();

  OutboundQueue& outbound() { return *outbound_; }
  const std::string& cell() const { return options_.cell; }
  /// There is an announcement in outbound(), which does not change any more.
  bool announces() const { return announces_.load(); }
  /// Figures to show while no scenario is loaded; nothing while one is.
  std::optional<LoopStatus> idle_status() const;
  /// The loop of the loaded scenario or nullptr; valid until a request exchanges it.
  RunLoop* loop() const;
  /// Its simulation: to be touched only when the loop has ended.
  const Simulation* simulation() const;

 private:
  struct LoadedScenario;
  struct Job {
    ControlRequest request;
    HostAction action;
  };
  void run();
  void execute(const Job& job);
  void load(std::uint64_t id, const ScenarioSource& source);
  void unload(std::uint64_t id);
  std::shared_ptr<LoadedScenario> build(const ScenarioSource& source);
  std::shared_ptr<LoadedScenario> build(const Scenario& scenario);
  std::shared_ptr<LoadedScenario> make_loaded(std::shared_ptr<CellModel> model, double duration_s);
  std::variant<std::shared_ptr<LoadedScenario>, HostRefusal> try_build(const ScenarioSource& source);
  void opened();
  // cell_host_changes.cpp
  /// spawn_entity, delete_entity
  void change(const Job& job);
  void reset_spawned(const Job& job, const ResetSpawned& request);
  /// What is loaded, or nullptr when a refusal was replied: nothing, or not from a file.
  std::shared_ptr<LoadedScenario> changeable(std::uint64_t id);
  /// The loaded scenario with another content; replies, and says whether it was done.
  bool exchange_content(const Job& job, const Scenario& wanted, bool any_state,
                        std::vector<ControlRequest> changes, const std::string& done, TextArguments values);
  // cell_host_snapshots.cpp
  void save(const Job& job, const SaveSnapshot& request);
  void restore(const Job& job, const RestoreSnapshot& request);
  /// False when a refusal was replied.
  bool snapshots_possible(std::uint64_t id, const std::string& name);
  Session session_of(const LoadedScenario* loaded) const;
  /// Says how it goes on, as the end of a sentence.
  std::string resume_session(const Session& session);
  // cell_host_recording.cpp
  static LogScenario logged_scenario(const LoadedScenario& loaded);
  std::unique_ptr<LogRecorder> make_recorder(const std::filesystem::path& file, bool replace);
  void open_log();        ///< of the options. Throws LogError
  void open_log_again();  ///< in a server that was started again
  void record(LoadedScenario& loaded);
  void end_recording();
  void start_recording(const Job& job, const StartRecording& request);
  void stop_recording(const Job& job);
  bool is_own_log() const;  ///< what is being recorded is HostOptions::log
  /// nullptr: none. `kept_state`: pace and controllers stay, and the new loop starts in that state.
  void exchange(std::shared_ptr<LoadedScenario> next,
                std::optional<SimulationState> kept_state = std::nullopt);
  /// As above; false when the new one could not be shown and nothing is loaded now, which was replied.
  bool try_exchange(std::uint64_t id, std::shared_ptr<LoadedScenario> next,
                    std::optional<SimulationState> kept_state);
  void reply(std::uint64_t id, ControlResult result, std::string message, TextArguments values = {});
  void tell(Severity severity, std::string code, std::string message);
  void answer_without_scenario(const ControlRequest& request);
  SimulationState state_without_scenario() const;
  std::shared_ptr<LoadedScenario> loaded_scenario() const;

  HostOptions options_;  ///< the pace in it: guarded by mutex_
  std::shared_ptr<OutboundQueue> outbound_ = std::make_shared<OutboundQueue>();
  CellLifecycleListener* observer_ = nullptr;
  std::function<void()> on_quit_;
  std::optional<WorkerPool> pool_;
  std::optional<SessionStore> store_;
  std::unique_ptr<LogRecorder> recorder_;  ///< thread of the host, or of open(), or the last of stop()
  std::uint32_t scenarios_loaded_ = 0;     ///< loaded so far; thread of the host, or of open()

  mutable std::mutex mutex_;
  std::condition_variable news_;
  std::shared_ptr<LoadedScenario> loaded_;                // guarded by mutex_, as all below
  std::optional<Job> job_;                                ///< waiting or being executed
  std::string busy_with_ = "loading its first scenario";  ///< for people; empty: nothing
  bool opened_ = false;                                   ///< open() is done
  bool stop_ = false;
  std::atomic<bool> announces_{false};
  std::thread thread_;
};

}  // namespace takt
