#pragma once
// What the goals of actions mean in the cell, and what is reported of them: goals as commands, reports of the loop as
// feedback and results. Behaviour: ros2_controllers (joint_trajectory_controller, gripper controllers). No DDS.
#include <cstdint>
#include <string>
#include <variant>

#include "server/runtime/requests/goal_table.h"
#include "server/runtime/requests/motion_goal.h"
#include "server/simulation/model/cell_description.h"
#include "takt_actions.h"

namespace takt::ros {

/// Numbers of control_msgs/action/FollowJointTrajectory.
enum class TrajectoryError : std::int32_t {
  successful = 0,
  invalid_goal = -1,
  invalid_joints = -2,
  old_header_timestamp = -3,
  path_tolerance_violated = -4,
  goal_tolerance_violated = -5,
};

/// A command with its goal.
struct MotionOrder {
  Command command;
  GoalPtr goal;
};
/// `present`: simulated time. `target`: target_of() the robot or gripper. A refusal is a whole sentence.
Validated<MotionOrder> order_of(const CellDescription& cell, int target, std::uint64_t number,
                                SimTime present, actions::FollowJointTrajectory::Goal&& goal);
Validated<MotionOrder> order_of(const CellDescription& cell, int target, std::uint64_t number,
                                SimTime present, actions::GripperCmd::Goal&& goal);
Validated<MotionOrder> order_of(const CellDescription& cell, int target, std::uint64_t number,
                                SimTime present, actions::ParallelGripperCmd::Goal&& goal);

/// To cancel a goal. Its command is never applied: it says which target is meant.
MotionOrder cancellation_of(const CellDescription& cell, int target, std::uint64_t number);

/// The state that a goal ends in. `canceling`: a cancellation was accepted.
GoalState state_of(const GoalReport& report, bool canceling);

/// Why, for a person.
std::string text_of(const GoalReport& report, const CellDescription& cell, int target);

void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::FollowJointTrajectory::Feedback& feedback);
void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::FollowJointTrajectory::Result& result);
void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::GripperCmd::Feedback& feedback);
void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::GripperCmd::Result& result);
void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::ParallelGripperCmd::Feedback& feedback);
void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::ParallelGripperCmd::Result& result);

}  // namespace takt::ros
