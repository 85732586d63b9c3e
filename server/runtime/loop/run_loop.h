#pragma once
// The step loop of the service: the one thread that touches the simulation.
//
//   pacer.wait -> commands.take_all -> simulation.step(commands) -> output.snapshots.publish
//
// Commands come in through commands(), control requests through submit(), both from any thread; everything
// that goes out lies in output(). The loop knows no transport, and in steady state neither allocates nor
// waits for a reader.
//
// Requests are executed between two steps. What takes longer than a look (explain_part, get_entity_state)
// waits in a queue of which at most one is answered before a step, so that no client can hold up the
// simulation with questions.
//
// Lockstep: at a step that is a boundary of a registered controller (controller_registry.h) the loop waits
// until every target of that controller has a command stamped with that step's time, to the nanosecond, and
// applies them together in the very next step, robots before grippers, in index order. So the results depend
// on the commands alone. While a robot follows a trajectory, its controller has nothing to send for it.
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "idl/common/histogram.h"
#include "server/runtime/auto_reset_event.h"
#include "server/runtime/loop/command_buffer.h"
#include "server/runtime/loop/controller_registry.h"
#include "server/runtime/loop/loop_output.h"
#include "server/runtime/pacer.h"
#include "server/runtime/recording/snapshot_file.h"
#include "server/runtime/requests/control.h"
#include "server/runtime/requests/pressure_subscriptions.h"
#include "server/simulation/step/simulation.h"

namespace takt {

class LogRecorder;

struct RunLoopOptions {
  Pace pace = Pace::realtime;
  double factor = 1.0;  ///< simulated seconds per second of wall time, for realtime
  bool start_paused = false;
  bool start_stopped = false;          ///< before start_paused
  int realtime_priority = 0;           ///< see obtain_scheduling()
  std::optional<double> pause_at_s{};  ///< simulated time at which to pause with the event end_of_scenario
  bool quit_at_end = false;            ///< and then end the loop
  /// Called in the loop's thread with every instant, the first one and those after a reset included: for
  /// tests and for recording in-process. Empty: none.
  std::function<void(const Simulation&)> on_instant{};
  /// Saves the state so often (wall time, s) into saved(), while anything changes; 0: never.
  double save_every_s = 0.0;
  MonotonicClock* clock =
      nullptr;  ///< of the schedule, for tests; nullptr: CLOCK_MONOTONIC. Outlives the loop
  std::shared_ptr<OutboundQueue> outbound{};  ///< to share with other loops; empty: one of its own
};

/// The state of the simulation between two steps, and of its loop.
struct SavedState {
  std::vector<std::byte> bytes;  ///< of Simulation::save_state()
  SnapshotIdentity identity;
  SimulationState state{};
  Pace pace{};
  double factor = 1.0;
};

class RunLoop {
 public:
  /// `simulation` must outlive the loop and is touched only by its thread from start() to the end of stop().
  RunLoop(Simulation& simulation, RunLoopOptions options);
  ~RunLoop();
  RunLoop(const RunLoop&) = delete;
  RunLoop& operator=(const RunLoop&) = delete;

  void start();
  /// Ends the loop between two steps and joins its thread. May be called more than once.
  void stop();
  /// The loop has ended or is about to: set_state quitting, or quit_at_end.
  bool quitting() const { return quitting_.load(); }
  /// Any thread: called once, from the loop's thread, when the loop ends of itself. Set it before start().
  void set_on_quit(std::function<void()> on_quit) { on_quit_ = std::move(on_quit); }

  /// Any thread. As CommandBuffer::append, and wakes a waiting loop.
  std::optional<Rejection> append(const Command& command, std::uint64_t sender, std::int64_t received_ns);
  /// Any thread. The reply comes through output(): at once when the request is not well-formed, else when it
  /// was done.
  /// A loop that has ended refuses, also what waited until then.
  void submit(const ControlRequest& request);

  LoopOutput& output() { return output_; }
  /// To be called by the reader of the output after writing a snapshot.
  void snapshot_written(std::uint64_t number);

  /// The newest state saved, see RunLoopOptions::save_every_s; for one thread, which is woken by
  /// saved_news().
  TripleBuffer<SavedState>& saved() { return saved_; }
  AutoResetEvent& saved_news() { return saved_news_; }
  /// In the loop's thread, or before start(). Empty if done, else why the state cannot be saved
  /// (Simulation::save_state).
  std::string save(SavedState& saved);

  /// In the loop's thread, or before start(): records from here on what changes the simulation; nullptr ends
  /// that. It must outlive the loop, or its replacement.
  void record_with(LogRecorder* recorder) { recorder_ = recorder; }
  LogRecorder* recorder() const { return recorder_; }

  /// Before start(): another state than that of the options.
  void begin_in(SimulationState state) { state_ = state; }
  /// Before start(): another pace than that of the options.
  void begin_with(Pace pace, double factor) {
    pace_ = pace;
    factor_ = factor;
  }
  /// Before start(): pace and controllers of a loop that has ended and whose cell has the same robots and
  /// grippers.
  void inherit_from(const RunLoop& other, SimulationState state);
  /// Another thread: executes the action in the loop's thread, between two steps, and returns then. False:
  /// the loop is not running, nothing was done. One thread at a time.
  bool between_steps(const std::function<void()>& action);
  /// In the loop's thread: a saved state of this cell, as Simulation::restore_state(), with pace, controllers
  /// and whether it plays as they are. Their boundaries go on from there; commands that wait are dropped.
  std::string restore(std::span<const std::byte> state);
  /// Another thread: from here to release() the loop takes no step and executes no request; what comes in
  /// waits. Returns its state, or nothing when it is not running. One thread may hold it.
  std::optional<SimulationState> hold();
  void release();
  /// Once the loop has ended: what the next one goes on with.
  Pace pace() const { return pace_; }
  double pace_factor() const { return factor_; }

  /// Seconds since the server began, for reports.
  double wall_time_s() const;
  const CellDescription& cell() const { return simulation_.description(); }
  /// Most contacts that a published snapshot holds.
  std::size_t contact_capacity() const { return simulation_.contact_capacity(); }
  /// Of no concern to the loop: what clients and the writer of samples agree upon.
  PressureSubscriptions& pressures() { return pressures_; }

 private:
  struct Pending {
    bool present = false;
    ReceivedCommand received;
  };
  struct PendingAction {
    std::uint64_t id = 0;
    ControlAction action;
  };
  struct Query {
    std::uint64_t id = 0;
    int component = -1;
    bool why = false;  ///< explain_part; else get_entity_state
  };
  struct RateSample {
    std::int64_t wall_ns = 0;
    double time_s = 0.0;
    std::int64_t computed_ns = 0;
  };

  void run();
  void execute_requests();
  void refuse_what_waits();
  void park();
  /// Of the right size, so that saving allocates only where a state is larger than all before.
  static SavedState first_saved(Simulation& simulation, const RunLoopOptions& options);
  void save_if_due();
  void reply(std::uint64_t id, ControlResult result, std::string message, TextArguments values = {});
  void execute(std::uint64_t id, const SetState& action);
  void execute(std::uint64_t id, const Step& action);
  void execute(std::uint64_t id, const SetPace& action);
  void execute(std::uint64_t id, const RegisterController& action);
  void execute(std::uint64_t id, const UnregisterController& action);
  void execute(std::uint64_t id, const SetLevelOfDetail& action);
  void execute_get_state(std::uint64_t id);
  void take_query(const Query& query);
  void answer_query();
  void execute(std::uint64_t id, const SetEntityState& action);
  void execute(std::uint64_t id, const Attach& action);
  void execute(std::uint64_t id, const Detach& action);
  void do_reset();
  /// After the simulation was put to another instant.
  void reset_loop_state(std::uint64_t step);
  void set_state(SimulationState state);
  void end_single_steps(ControlResult result, const std::string& message);

  void collect_commands();
  bool accept_in_lockstep(int target, ReceivedCommand& received);
  bool may_step();
  bool boundary_commands_present();
  bool covered_by_trajectory(int target, double time_s) const;
  /// Tells that it is late; the event of its time-out when that is over.
  std::optional<EventRecord> wait_for_controller(ControllerRegistry::Controller& controller,
                                                 int missing_target);
  void take_step();
  void gather_batch();
  void finish_boundaries(std::uint64_t step);
  void pause_with(EventRecord event);
  void publish_instant();
  void wait_until_written();
  void publish_status(std::int64_t now_ns);
  void publish_status_if_due();
  EventRecord event(EventCode code, Severity severity) const;
  void emit(const EventRecord& event);
  void anchor();

  Simulation& simulation_;
  RunLoopOptions options_;
  CommandBuffer buffer_;
  LoopOutput output_;
  Pacer pacer_;
  PressureSubscriptions pressures_;
  ControllerRegistry registry_;

  std::thread thread_;
  AutoResetEvent wakeup_;
  std::atomic<bool> stop_{false}, quitting_{false}, requests_waiting_{false};
  std::mutex requests_mutex_;
  std::vector<PendingAction> requests_;  // guarded by requests_mutex_
  bool closed_ = false;                  // guarded by requests_mutex_: the loop has ended
  bool running_ = false;                 // guarded by requests_mutex_: its thread may execute requests
  const std::function<void()>* visit_ = nullptr;  // guarded by requests_mutex_: see between_steps()
  std::condition_variable visited_;
  std::atomic<bool> hold_{false};
  std::function<void()> on_quit_;

  // From here on: the loop's thread only.
  SimulationState state_;
  Pace pace_;
  double factor_;
  LogRecorder* recorder_ = nullptr;
  bool faulted_ = false, ended_ = false;
  std::vector<Query> queries_;  ///< to be answered one between two steps, oldest first
  std::uint64_t single_steps_left_ = 0;
  std::uint64_t single_steps_request_ = 0;  ///< id of the request being worked on
  std::vector<ReceivedCommand> incoming_;
  std::vector<Pending> pending_;  ///< per target: the newest command not yet applied
  std::vector<Command> batch_;
  std::uint64_t published_ = 0;
  std::uint32_t contact_pairs_ = 0;  ///< in the newest instant published
  TripleBuffer<SavedState> saved_;
  AutoResetEvent saved_news_;
  SnapshotIdentity identity_;  ///< of this cell; step and time change
  bool changed_since_save_ = true;
  bool save_refused_ = false;  ///< the newest periodic one
  std::int64_t next_save_ns_ = 0;

  std::int64_t wait_began_ns_ = 0;  ///< at the present boundary; 0: not waiting
  bool wait_in_status_ = false;
  std::array<FixedString<128>, 16> waiting_for_;
  std::uint32_t waiting_count_ = 0;

  FixedString<256> scheduling_;
  std::int64_t next_status_ns_ = 0;
  std::int64_t computed_ns_ = 0;  ///< sum of the steps' computation times
  DurationHistogram step_time_, command_latency_;
  std::uint64_t commands_applied_ = 0, commands_rejected_ = 0, events_lost_told_ = 0;
  std::array<RateSample, 11> rate_;
  std::size_t rate_count_ = 0;
};

}  // namespace takt
