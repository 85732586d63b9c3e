#pragma once
// A goal of a robot or a gripper: a command with an end that is waited for, and what the step loop reports of it. The
// loop alone decides on the end, after the step in which it comes, so that the decision does not depend on a clock.
#include <cstdint>
#include <memory>

#include "server/simulation/model/command.h"

namespace takt {

/// Largest permitted deviations by joint (rad or m, and per s); 0: not checked.
struct JointTolerances {
  JointArray position{}, velocity{};
};

/// Constant once it is handed to the loop.
struct MotionGoal {
  enum class Kind : std::uint8_t {
    trajectory,  ///< its command is a TrajectoryCommand
    grip,        ///< its command is a GripperCommand
    cancel,      ///< its command stops the target; ends the goal `number` as cancelled
  };
  Kind kind{};
  std::uint64_t number = 0;
  int target = -1;  ///< target_of() its command

  // Of a trajectory.
  std::shared_ptr<const JointPath> path;
  SimTime stamp;
  JointTolerances path_tolerance, goal_tolerance;
  /// After the end of the path the robot must be within `goal_tolerance` for so long (s); 0: without limit.
  double goal_time_tolerance_s = 0.0;

  // Of a grip.
  double width_m = 0.0;
  double width_tolerance_m = 0.0;
  double stall_timeout_s = 0.0;  ///< the jaws stand for so long away from `width_m`: stalled
};
using GoalPtr = std::shared_ptr<const MotionGoal>;

/// Why a goal ended.
enum class GoalEnd : std::uint8_t {
  none,            ///< it continues
  reached,         ///< at its aim
  stalled,         ///< the jaws stand before their aim; `part`: what they hold
  cancelled,       ///< as asked
  preempted,       ///< a later goal of the same target took effect
  replaced,        ///< a command from elsewhere took effect
  path_tolerance,  ///< `joint` deviated by `value` of `limit` at most
  goal_tolerance,  ///< `joint` deviates by `value` of `limit` at most, `goal_time_tolerance_s` after the end
  refused,  ///< the robot cannot follow from where it is: `joint` would have `value` of at most `limit`
  past,     ///< its end was over when it took effect
  reset,    ///< the simulation was put to another instant
};

/// What the loop reports: feedback about 20 times a simulated second, and the end.
struct GoalReport {
  std::uint64_t number = 0;
  GoalEnd end = GoalEnd::none;
  bool begins = false;  ///< with the first report of a goal that takes effect
  double time_s = 0.0;  ///< simulated
  int joint = -1;
  bool of_velocity = false;
  double value = 0.0, limit = 0.0;
  // Of a robot.
  double path_time_s = 0.0;  ///< since the start of the path
  JointArray desired_position{}, desired_velocity{}, desired_acceleration{};
  JointArray position{}, velocity{};
  // Of a gripper.
  double width_m = 0.0, force_N = 0.0;
  int part = -1;  ///< that it holds, or -1
};

}  // namespace takt
