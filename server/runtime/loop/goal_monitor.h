#pragma once
// Watches the goals of robots and grippers step by step: when they take effect, whether they are within their
// tolerances, and how they end. It touches no state of the simulation; the command that stops a robot goes the way of
// all commands, into the command log too. For the loop's thread only; it neither allocates nor waits.
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "idl/common/spsc_ring.h"
#include "server/runtime/requests/motion_goal.h"
#include "server/simulation/step/simulation.h"

namespace takt {

class GoalMonitor {
 public:
  /// Between two reports of a running goal, in simulated time.
  static constexpr double kFeedback_s = 0.05;
  /// A gripper goal may be judged stalled after this time at the earliest (the jaws accelerate).
  static constexpr double kJawsBegin_s = 0.05;

  /// Both outlive it.
  GoalMonitor(const Simulation& simulation, SpscRing<GoalReport>& reports);

  /// Ahead of a step from t on: the commands of its batch and their goals (nullptr: of another sender).
  void apply(std::span<const Command> batch, std::span<const GoalPtr> goals);
  /// After the step. `stop`: called with each target that must be stopped.
  void stepped(const std::function<void(int target)>& stop);
  /// A goal that will not take effect.
  void drop(const MotionGoal& goal, GoalEnd end);
  /// Ends a goal that runs(): as asked from outside. The caller stops the target.
  void cancel(int target);
  /// The simulation was put to another instant, or has failed: all goals end.
  void restart();

  /// The goal has taken effect and continues.
  bool runs(int target, std::uint64_t number) const {
    const GoalPtr& goal = slots_[static_cast<std::size_t>(target)].goal;
    return goal && goal->number == number;
  }
  /// When a gripper was read last.
  const GripperSample& gripper(int index) const {
    return machines_.grippers[static_cast<std::size_t>(index)];
  }
  /// Whether a report was made since the last call.
  bool take_news() { return std::exchange(news_, false); }

 private:
  struct Slot {
    GoalPtr goal;
    double start_s = 0.0;
    bool begun = false;  ///< its start has been reached
    JointPathPoint begin{};
    std::size_t next = 0;
    double feedback_s = 0.0;       ///< time of the next one
    double stands_since_s = -1.0;  ///< of the jaws; negative: they move
  };

  void start(Slot& slot, const GoalPtr& goal, double t);
  void begin(Slot& slot, double t);
  void end(Slot& slot, GoalReport report, GoalEnd end);
  void watch_robot(Slot& slot, std::size_t robot, double t, const std::function<void(int)>& stop);
  void watch_gripper(Slot& slot, std::size_t gripper, double t);
  void fill_desired(const Slot& slot, double path_time_s, GoalReport& report) const;
  GoalReport report_of(const Slot& slot, double t) const;
  void push(const GoalReport& report);
  void push_late();
  bool active() const;

  const Simulation& simulation_;
  const CellDescription& cell_;
  SpscRing<GoalReport>& reports_;
  std::vector<Slot> slots_;  ///< by target, of robots and grippers
  Snapshot machines_;
  std::vector<GoalReport> late_;  ///< ends that the full ring did not take
  bool news_ = false;
};

}  // namespace takt
