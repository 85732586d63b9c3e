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
#include "server/runtime/loop/lockstep_barrier.h"
#include "server/runtime/loop/loop_context.h"
#include "server/runtime/loop/periodic_saver.h"
#include "server/runtime/loop/run_loop_options.h"
#include "server/runtime/loop/status_publisher.h"
#include "server/runtime/pacer.h"

namespace takt {

class LoopControl {
 public:
  /// All outlive it. `wakeup`: posted when an instant was written; `stop`: the loop is to end.
  LoopControl(Simulation& simulation, LoopOutput& output, const RunLoopOptions& options,
              AutoResetEvent& wakeup, std::atomic<bool>& stop);

  LoopContext context;
  LockstepBarrier barrier;
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
  void publish_instant();

  void set_state(SimulationState state);
  void set_pace(Pace pace, double factor);
  void quit();
  void reset();
  /// See RunLoop::restore().
  std::string restore(std::span<const std::byte> state);

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
  void wait_until_written();
  bool at_the_end() const;

  const RunLoopOptions& options_;
  AutoResetEvent& wakeup_;
  std::atomic<bool>& stop_;
  bool ended_ = false;           ///< paused at RunLoopOptions::pause_at_s
  std::uint64_t published_ = 0;  ///< instants
  std::uint64_t single_steps_left_ = 0;
  std::uint64_t single_steps_request_ = 0;  ///< 0: without
};

}  // namespace takt
