#pragma once
// The step loop of the service: the one thread that touches the simulation. One iteration:
//
//   serve visits -> execute requests -> answer a query -> collect commands -> wait -> step -> publish
//
// Commands arrive through append(), control requests through submit(), both from any thread; all results are
// in output(). The loop uses no transport, and in steady state neither allocates nor waits for a reader.
// Requests are executed between two steps (request_executor.h).
//
// In lockstep it waits at the boundaries of registered controllers (lockstep_barrier.h) and applies their
// commands together in the next step, robots before grippers, in index order. So the results depend on the
// commands alone.
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "server/runtime/loop/loop_control.h"
#include "server/runtime/loop/loop_output.h"
#include "server/runtime/loop/loop_wakeup.h"
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
  /// Any thread: `on_quit` is called once, from the loop's thread, when the loop ends by itself. Set it ahead
  /// of start().
  void set_on_quit(std::function<void()> on_quit) { on_quit_ = std::move(on_quit); }

  /// Any thread. As CommandBuffer::append, and wakes a waiting loop.
  std::optional<Rejection> append(const Command& command, std::uint64_t sender, std::int64_t received_ns);
  /// The same for a goal that the command serves. Unless refused here, its end is reported in output().goals, or
  /// comes with the end of the loop.
  std::optional<Rejection> append(const Command& command, GoalPtr goal);
  /// Any thread: simulated time of the newest step.
  SimTime present() { return control_.intake.buffer().present(); }
  /// Any thread: a request of phase loop or query. The reply comes through output() after execution. A loop
  /// that has ended refuses all requests, including waiting ones.
  void submit(std::uint64_t id, requests::Any request);

  /// Ahead of start(), or after the loop's end: in lockstep the loop receives its input with `receiver` while it waits;
  /// nullptr: it does not.
  void receive_with(InputReceiver* receiver) { wakeup_.receive_with(receiver); }

  LoopOutput& output() { return output_; }
  /// Periodically saved states, see RunLoopOptions::save_every_s.
  PeriodicSaver& saver() { return control_.saver; }

  /// In the loop's thread, or ahead of start(): records later changes of the simulation; nullptr ends the
  /// recording. The recorder must outlive the loop, or its replacement.
  void record_with(LogRecorder* recorder) { control_.context.recorder = recorder; }

  /// Another thread: executes the action in the loop's thread, between two steps, and returns after it.
  /// False: the loop is not running, and the action was not executed. One thread at a time.
  bool between_steps(const std::function<void()>& action) { return inbox_.visit(action, wakeup_); }
  /// In the loop's thread: restores a saved state of this cell, as Simulation::restore_state(); pace,
  /// controllers and play state stay. The controllers' boundaries continue from that instant; waiting
  /// commands are discarded.
  std::string restore(std::span<const std::byte> state) { return control_.restore(state); }
  /// Another thread: until resume() the loop takes no step and executes no request; its input waits. Returns
  /// its state, or std::nullopt if it is not running. One thread may suspend it.
  std::optional<SimulationState> suspend();
  void resume();

  // After the end of the loop: values for its successor.
  Pace pace() const { return control_.context.pace; }
  double pace_factor() const { return control_.context.factor; }
  std::vector<requests::RegisterController> controllers() const;

  const CellDescription& cell() const { return control_.context.cell(); }

 private:
  void run();
  /// False: the step is not due; the loop has slept for a while.
  bool wait_for_schedule();
  /// Without a step to take: publishes due output and sleeps until there is input.
  void stand(std::int64_t longest_ns);

  const RunLoopOptions options_;
  LoopOutput output_;
  LoopWakeup wakeup_;
  std::atomic<bool> stop_{false}, suspended_{false};
  LoopControl control_;
  RequestExecutor executor_;
  RequestInbox inbox_;
  std::function<void()> on_quit_;
  std::thread thread_;
};

}  // namespace takt
