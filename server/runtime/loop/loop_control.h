#pragma once
// Control of the simulation between two steps, by the loop and by requests: play, pause, reset, change of
// pace, step, publication of the instant. For the loop's thread only, except CommandIntake::buffer() and
// PeriodicSaver::saved().
#include <atomic>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "server/runtime/loop/command_intake.h"
#include "server/runtime/loop/goal_monitor.h"
#include "server/runtime/loop/instant_schedule.h"
#include "server/runtime/loop/lockstep_barrier.h"
#include "server/runtime/loop/loop_context.h"
#include "server/runtime/loop/periodic_saver.h"
#include "server/runtime/loop/run_loop_options.h"
#include "server/runtime/loop/status_publisher.h"
#include "server/runtime/pacer.h"

namespace takt {

class LoopControl {
 public:
  /// All outlive it. `stop`: the loop is to end.
  LoopControl(Simulation& simulation, LoopOutput& output, const RunLoopOptions& options,
              std::atomic<bool>& stop);

  LoopContext context;
  LockstepBarrier barrier;
  GoalMonitor goals;
  CommandIntake intake;
  Pacer pacer;
  StatusPublisher status;
  PeriodicSaver saver;

  /// The request to end the server, by set_state or RunLoopOptions::quit_at_end.
  std::atomic<bool> quits{false};

  void begin();
  /// Whether a step may be taken: the simulation plays or steps, and in lockstep all commands are present.
  bool may_step();
  void take_step();
  /// Ahead of a wait: in lockstep the last missing command wakes the loop.
  void expect_commands();
  void publish_instant();
  /// Ahead of a wait: publishes the present instant unless it is the newest published.
  void publish_skipped_instant() {
    if (instant_skipped_) publish_instant();
  }
  /// During a long wait for the next step: for a reader that came meanwhile.
  void publish_skipped_instant_if_read() {
    if (instant_skipped_ && context.output.readers.any()) publish_instant();
  }

  void set_state(SimulationState state);
  void set_pace(Pace pace, double factor);
  void quit();
  void reset();
  /// See RunLoop::restore().
  std::string restore(std::span<const std::byte> state);

  void watch(const requests::WatchInstants& request) {
    instants_.watch(request, context.simulation.time_s(), monotonic_now_ns());
  }

  /// Single steps for a request; the reply follows after the last step or an interruption.
  void begin_single_steps(std::uint64_t request, std::uint64_t count);
  std::uint64_t single_steps_left() const { return single_steps_left_; }
  /// ControlResult::ok: they are done.
  void end_single_steps(Refusal end);

 private:
  void pause_with(const events::OfLoop& event);
  /// After the simulation was put to another instant.
  void restart(std::uint64_t step);
  void anchor() { pacer.anchor(context.cell().step_s, context.factor); }
  /// The simulation is at another instant: publishes it, or lets it be.
  void arrive(bool wanted = true);
  bool instant_is_wanted(std::int64_t now_ns);
  bool at_the_end() const;

  const RunLoopOptions& options_;
  std::atomic<bool>& stop_;
  InstantSchedule instants_;  ///< in lockstep
  std::vector<int> missing_;
  bool instant_skipped_ = false;  ///< the present instant is not published
  bool ended_ = false;            ///< paused at RunLoopOptions::pause_at_s
  std::uint64_t single_steps_left_ = 0;
  std::uint64_t single_steps_request_ = 0;  ///< 0: without
};

}  // namespace takt
