#pragma once
// The way of commands from the buffer into a step: of several commands for one robot, gripper or device the
// newest one counts; the batch of a step has at most one command per target, robots before grippers before
// devices, in index order.
#include <optional>
#include <span>
#include <vector>

#include "idl/common/histogram.h"
#include "server/runtime/loop/command_buffer.h"
#include "server/runtime/loop/lockstep_barrier.h"
#include "server/runtime/loop/loop_context.h"
#include "server/runtime/loop/scheduled_commands.h"

namespace takt {

class CommandIntake {
 public:
  /// Both arguments must outlive it.
  CommandIntake(LoopContext& loop, LockstepBarrier& barrier);

  /// Where adapters append.
  CommandBuffer& buffer() { return buffer_; }

  // From here on: the loop's thread.

  /// Takes the buffered commands. In lockstep the barrier decides on each.
  void collect();
  /// Whether the target has a command for the present step.
  bool has(int target) const;
  /// The commands for the next step. In lockstep those of controllers wait for their boundary.
  std::span<const Command> take_batch();
  std::uint64_t applied() const { return applied_; }  ///< commands in all batches whose step was taken
  void count_applied() { applied_ += batch_.size(); }
  /// Wall time from the wire to the batch.
  const DurationHistogram& latency() const { return latency_; }

  /// Sets the present instant of the simulation, for the rule about stamps.
  void set_present(double time_s) { buffer_.set_present(SimTime::from_seconds(time_s)); }
  /// Discards the target's waiting commands.
  void drop(int target);
  /// Discards waiting commands but those for boundaries ahead, which hold at any pace.
  void drop_present() { waiting_.assign(waiting_.size(), std::nullopt); }
  /// After a jump of the simulation to another instant: discards waiting commands, stamps and figures.
  void restart();

 private:
  LoopContext& loop_;
  LockstepBarrier& barrier_;
  CommandBuffer buffer_;
  std::vector<ReceivedCommand> incoming_;
  std::vector<std::optional<ReceivedCommand>> waiting_;  ///< by target: the newest not yet applied
  ScheduledCommands ahead_;
  std::vector<std::uint64_t> senders_;  ///< by target: of the last command that was kept
  std::vector<Command> batch_;
  std::uint64_t applied_ = 0;
  DurationHistogram latency_;
};

}  // namespace takt
