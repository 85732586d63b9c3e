#pragma once
// The way of commands from the buffer into a step: of several commands for one robot, gripper or device the
// newest one counts; the batch of a step has at most one command per target, robots before grippers before
// devices, in index order.
#include <optional>
#include <span>
#include <vector>

#include "idl/common/histogram.h"
#include "server/runtime/loop/command_buffer.h"
#include "server/runtime/loop/goal_monitor.h"
#include "server/runtime/loop/lockstep_barrier.h"
#include "server/runtime/loop/loop_context.h"
#include "server/runtime/loop/scheduled_commands.h"

namespace takt {

class CommandIntake {
 public:
  /// All must outlive it.
  CommandIntake(LoopContext& loop, LockstepBarrier& barrier, GoalMonitor& goals);

  /// Where adapters append.
  CommandBuffer& buffer() { return buffer_; }

  // From here on: the loop's thread.

  /// Takes the buffered commands. In lockstep the barrier decides on each.
  void collect();
  /// Whether the target has a command for the present step.
  bool has(int target) const;
  /// The commands for the next step. In lockstep those of controllers wait for their boundary.
  std::span<const Command> take_batch();
  /// Of the newest batch: the goal of each command, or nullptr.
  std::span<const GoalPtr> batch_goals() const { return batch_goals_; }
  /// The target stops in the next step, at a boundary or not, unless it gets another command by then: a robot
  /// brakes, the jaws of a gripper stay where they are. A gripper that holds a Part keeps its command: it holds on.
  void stop(int target);
  std::uint64_t applied() const { return applied_; }  ///< commands in all batches whose step was taken
  void count_applied() { applied_ += batch_.size(); }
  /// Wall time from the wire to the batch.
  const DurationHistogram& latency() const { return latency_; }

  /// Sets the present instant of the simulation, for the rule about stamps.
  void set_present(double time_s) { buffer_.set_present(SimTime::from_seconds(time_s)); }
  /// Discards the target's waiting commands whose time has lost its meaning. Goals stay: they have no time in mind.
  void drop(int target) {
    drop_present(target);
    ahead_.drop(target);
  }
  /// The same of all targets, but for commands at boundaries ahead, which hold at any pace.
  void drop_present() {
    for (std::size_t target = 0; target < waiting_.size(); ++target) drop_present(static_cast<int>(target));
  }
  /// After a jump of the simulation to another instant: discards waiting commands, stamps and figures.
  void restart();

 private:
  void drop_present(int target) {
    auto& waiting = waiting_[static_cast<std::size_t>(target)];
    if (waiting && !waiting->goal) waiting.reset();
  }
  void discard(std::optional<ReceivedCommand>& waiting, GoalEnd end);
  /// In lockstep: by the barrier.
  bool is_admitted(const ReceivedCommand& received);
  /// Of a goal that waits or runs.
  void cancel(const ReceivedCommand& received);

  LoopContext& loop_;
  LockstepBarrier& barrier_;
  GoalMonitor& goals_;
  const std::shared_ptr<const JointPath> no_path_ = std::make_shared<JointPath>();
  CommandBuffer buffer_;
  std::vector<ReceivedCommand> incoming_;
  std::vector<std::optional<ReceivedCommand>> waiting_;  ///< by target: the newest not yet applied
  ScheduledCommands ahead_;
  std::vector<std::uint64_t> senders_;  ///< by target: of the last command that was kept
  std::vector<SimTime> newest_;         ///< by target: its stamp
  /// By target: answers to states of before the last restart that may arrive a second time.
  struct Repeats {
    SimTime until;
    std::uint64_t left = 0;
  };
  std::vector<Repeats> repeats_;
  std::vector<std::optional<Command>> stops_;  ///< by target
  std::vector<Command> batch_;
  std::vector<GoalPtr> batch_goals_;
  std::uint64_t applied_ = 0;
  DurationHistogram latency_;
};

}  // namespace takt
