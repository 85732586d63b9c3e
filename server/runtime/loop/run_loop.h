#pragma once
// The step loop of the service: the one thread that touches the simulation. One iteration:
//
//   serve visits -> execute requests -> answer a query -> collect commands -> wait -> step -> publish
//
// Commands come in through append(), control requests through submit(), both from any thread; everything that
// goes out lies in output(). The loop knows no transport, and in steady state neither allocates nor waits for a
// reader. Requests are executed between two steps (request_executor.h).
//
// In lockstep it waits at the boundaries of registered controllers (lockstep_barrier.h) and applies their commands
// together in the very next step, robots before grippers, in index order. So the results depend on the commands
// alone.
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "server/runtime/auto_reset_event.h"
#include "server/runtime/loop/loop_control.h"
#include "server/runtime/loop/loop_output.h"
#include "server/runtime/loop/request_executor.h"
#include "server/runtime/loop/request_inbox.h"
#include "server/runtime/loop/run_loop_options.h"
#include "server/runtime/requests/control.h"
#include "server/simulation/step/simulation.h"

namespace takt {

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
  bool quitting() const { return control_.quits.load(); }
  /// Any thread: called once, from the loop's thread, when the loop ends of itself. Set it before start().
  void set_on_quit(std::function<void()> on_quit) { on_quit_ = std::move(on_quit); }

  /// Any thread. As CommandBuffer::append, and wakes a waiting loop.
  std::optional<Rejection> append(const Command& command, std::uint64_t sender, std::int64_t received_ns);
  /// Any thread: a request of phase loop or query. The reply comes through output(), when it was executed. A
  /// loop that has ended refuses, also what waited until then.
  void submit(std::uint64_t id, requests::Any request);

  LoopOutput& output() { return output_; }
  /// To be called by the reader of the output after writing a snapshot.
  void snapshot_written(std::uint64_t number);
  /// States saved now and then, see RunLoopOptions::save_every_s.
  PeriodicSaver& saver() { return control_.saver; }

  /// In the loop's thread, or before start(): records from here on what changes the simulation; nullptr ends
  /// that. It must outlive the loop, or its replacement.
  void record_with(LogRecorder* recorder) { control_.context.recorder = recorder; }

  /// Another thread: executes the action in the loop's thread, between two steps, and returns then. False:
  /// the loop is not running, nothing was done. One thread at a time.
  bool between_steps(const std::function<void()>& action) { return inbox_.visit(action, wakeup_); }
  /// In the loop's thread: a saved state of this cell, as Simulation::restore_state(), with pace, controllers
  /// and whether it plays as they are. Their boundaries go on from there; commands that wait are dropped.
  std::string restore(std::span<const std::byte> state) { return control_.restore(state); }
  /// Another thread: from here to resume() the loop takes no step and executes no request; what comes in
  /// waits. Returns its state, or nothing when it is not running. One thread may suspend it.
  std::optional<SimulationState> suspend();
  void resume();

  // Once the loop has ended: what the next one goes on with.
  Pace pace() const { return control_.context.pace; }
  double pace_factor() const { return control_.context.factor; }
  std::vector<requests::RegisterController> controllers() const;

  const CellDescription& cell() const { return control_.context.cell(); }

 private:
  void run();
  /// False: not now; the loop has slept for a while.
  bool wait_for_schedule();
  /// Nothing to simulate: publishes what is due and sleeps until there is news.
  void stand(std::int64_t longest_ns);

  const RunLoopOptions options_;
  LoopOutput output_;
  AutoResetEvent wakeup_;
  std::atomic<bool> stop_{false}, suspended_{false};
  LoopControl control_;
  RequestExecutor executor_;
  RequestInbox inbox_;
  std::function<void()> on_quit_;
  std::thread thread_;
};

}  // namespace takt
