#include "server/dds/action_goals.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "idl/common/stamp.h"
#include "idl/common/text.h"
#include "idl/common/utf8.h"
#include "server/dds/convert_commands.h"

namespace takt::ros {
namespace {

// Of the gripper controllers; the tolerance is theirs for angles, as a length.
constexpr double kStallTimeout_s = 1.0;
constexpr double kGripTolerance_m = 0.001;

const RobotDescription& robot_of(const CellDescription& cell, int target) {
  return cell.robots[static_cast<std::size_t>(target)];
}
const GripperDescription& gripper_of(const CellDescription& cell, int target) {
  return cell.grippers[static_cast<std::size_t>(target) - cell.robots.size()];
}

Rejection refusal(const CellDescription& cell, int target, RejectionCode code, const std::string& message) {
  return {code, std::string(target_name(cell, target)), "the goal is refused: " + message};
}

/// 0 is the default of the controller (not checked), -1 says so expressly.
std::optional<Rejection> read_tolerances(const CellDescription& cell, int target, const char* name,
                                         const std::vector<control_msgs::msg::JointTolerance>& given,
                                         JointTolerances& tolerances) {
  const auto& joints = robot_of(cell, target).arm.joints;
  for (const auto& one : given) {
    const auto joint =
        std::find_if(joints.begin(), joints.end(), [&](const auto& each) { return each.name == one.name; });
    if (joint == joints.end())
      return refusal(cell, target, RejectionCode::unknown_joint,
                     std::string(name) + " names the joint '" + utf8_sanitize(one.name, 60) +
                         "'; allowed: " + list_names(joints));
    for (const double value : {one.position, one.velocity, one.acceleration})
      if (!(value >= 0.0 || value == -1.0) || !std::isfinite(value))
        return refusal(cell, target, RejectionCode::out_of_range,
                       std::string(name) + " of joint '" + joint->name + "' is " + number_text(value) +
                           "; allowed are positive numbers, 0 for the default and -1 for none");
    if (one.acceleration > 0.0)
      return refusal(cell, target, RejectionCode::out_of_range,
                     std::string(name) + " of joint '" + joint->name +
                         "' limits the acceleration, which is not measured here; leave it 0");
    const auto j = static_cast<std::size_t>(joint - joints.begin());
    tolerances.position[j] = std::max(one.position, 0.0);
    tolerances.velocity[j] = std::max(one.velocity, 0.0);
  }
  return std::nullopt;
}

MotionGoal goal_of(MotionGoal::Kind kind, std::uint64_t number, int target) {
  MotionGoal goal;
  goal.kind = kind;
  goal.number = number;
  goal.target = target;
  return goal;
}

Validated<MotionOrder> grip(const CellDescription& cell, int target, std::uint64_t number, double width_m,
                            double force_N) {
  const auto command =
      validate(cell, target, RawGripperCommand{{}, GripperAction::width, width_m, std::max(force_N, 0.0)});
  if (const auto* rejection = std::get_if<Rejection>(&command)) return *rejection;
  MotionGoal goal = goal_of(MotionGoal::Kind::grip, number, target);
  goal.width_m = width_m;
  goal.width_tolerance_m = kGripTolerance_m;
  goal.stall_timeout_s = kStallTimeout_s;
  return MotionOrder{std::get<GripperCommand>(command), std::make_shared<const MotionGoal>(goal)};
}

sensor_msgs::msg::JointState jaw_state(const GoalReport& report, const CellDescription& cell, int target) {
  sensor_msgs::msg::JointState state;
  state.header.stamp = to_time(report.time_s);
  state.name = {gripper_of(cell, target).name};
  state.position = {report.width_m};
  state.effort = {report.force_N};
  return state;
}

}  // namespace

Validated<MotionOrder> order_of(const CellDescription& cell, int target, std::uint64_t number,
                                SimTime present, actions::FollowJointTrajectory::Goal&& goal) {
  const auto refuse = [&](RejectionCode code, const std::string& message) {
    return refusal(cell, target, code, message);
  };
  if (!goal.multi_dof_trajectory.points.empty() || !goal.component_path_tolerance.empty() ||
      !goal.component_goal_tolerance.empty())
    return refuse(RejectionCode::malformed,
                  "it has a multi-DOF trajectory or tolerances of components; the robot has single joints "
                  "alone, for `trajectory`");
  if (goal.trajectory.points.empty())
    return refuse(RejectionCode::malformed, "its trajectory has no points; at least one is needed");
  for (const auto& point : goal.trajectory.points)
    if (!point.effort.empty())
      return refuse(RejectionCode::malformed,
                    "its points have efforts, which the stock controller does not accept; the topic "
                    "joint_trajectory does");
  MotionGoal made = goal_of(MotionGoal::Kind::trajectory, number, target);
  if (auto fault = read_tolerances(cell, target, "path_tolerance", goal.path_tolerance, made.path_tolerance))
    return *std::move(fault);
  if (auto fault = read_tolerances(cell, target, "goal_tolerance", goal.goal_tolerance, made.goal_tolerance))
    return *std::move(fault);
  const auto& limit = goal.goal_time_tolerance;
  if (limit.nanosec >= 1'000'000'000U || limit.sec < -1)
    return refuse(RejectionCode::malformed, "its goal_time_tolerance is no duration");
  // -1: none, which is the default here.
  if (limit.sec >= 0)
    made.goal_time_tolerance_s = static_cast<double>(limit.sec) + static_cast<double>(limit.nanosec) * 1e-9;

  const auto raw = from_message(cell, target, std::move(goal.trajectory));
  if (const auto* rejection = std::get_if<Rejection>(&raw)) return *rejection;
  const auto command = validate(cell, target, std::get<RawTrajectory>(raw));
  if (const auto* rejection = std::get_if<Rejection>(&command)) return *rejection;
  const auto& trajectory = std::get<TrajectoryCommand>(command);
  made.path = trajectory.path;
  made.stamp = trajectory.stamp;
  const double end_s = made.stamp.seconds() + made.path->points.back().t;
  if (made.stamp.given() && end_s < present.seconds())
    return refuse(RejectionCode::stale, "its end, " + number_text(end_s) +
                                            " s of simulated time, is over; it is " +
                                            number_text(present.seconds()) + " s");
  return MotionOrder{trajectory, std::make_shared<const MotionGoal>(std::move(made))};
}

Validated<MotionOrder> order_of(const CellDescription& cell, int target, std::uint64_t number, SimTime,
                                actions::GripperCmd::Goal&& goal) {
  return grip(cell, target, number, goal.command.position, goal.command.max_effort);
}

Validated<MotionOrder> order_of(const CellDescription& cell, int target, std::uint64_t number, SimTime,
                                actions::ParallelGripperCmd::Goal&& goal) {
  const auto& command = goal.command;
  if (command.position.size() != 1)
    return refusal(cell, target, RejectionCode::wrong_count,
                   "it has " + std::to_string(command.position.size()) +
                       " positions; needed is one, the distance of the jaws (m)");
  if (!command.velocity.empty())
    return refusal(cell, target, RejectionCode::malformed,
                   "it limits the velocity; the jaws have the speed of the scenario. Leave velocity empty");
  if (command.effort.size() > 1)
    return refusal(cell, target, RejectionCode::wrong_count,
                   "it has " + std::to_string(command.effort.size()) + " efforts; one at most is allowed");
  return grip(cell, target, number, command.position.front(),
              command.effort.empty() ? 0.0 : command.effort.front());
}

MotionOrder cancellation_of(const CellDescription& cell, int target, std::uint64_t number) {
  const auto robots = static_cast<int>(cell.robots.size());
  Command command = TrajectoryCommand{target, {}, {}};
  if (target >= robots) {
    GripperCommand of_gripper;
    of_gripper.gripper = target - robots;
    command = of_gripper;
  }
  return {std::move(command),
          std::make_shared<const MotionGoal>(goal_of(MotionGoal::Kind::cancel, number, target))};
}

GoalState state_of(const GoalReport& report, bool canceling) {
  switch (report.end) {
    case GoalEnd::none:
      return GoalState::executing;
    case GoalEnd::reached:
      return GoalState::succeeded;
    case GoalEnd::stalled:
      return report.part >= 0 ? GoalState::succeeded : GoalState::aborted;
    case GoalEnd::cancelled:
      return GoalState::canceled;
    default:
      return canceling ? GoalState::canceled : GoalState::aborted;
  }
}

std::string text_of(const GoalReport& report, const CellDescription& cell, int target) {
  const bool of_robot = static_cast<std::size_t>(target) < cell.robots.size();
  std::string joint, unit;
  if (of_robot && report.joint >= 0) {
    const JointModel& model = robot_of(cell, target).arm.joints[static_cast<std::size_t>(report.joint)];
    joint = "joint '" + model.name + "'";
    unit = std::string(model.type == JointType::revolute ? "rad" : "m") + (report.of_velocity ? "/s" : "");
  }
  const std::string amount = number_text(report.value) + " " + unit,
                    limit = number_text(report.limit) + " " + unit;
  switch (report.end) {
    case GoalEnd::none:
      return {};
    case GoalEnd::reached:
      return "Goal successfully reached!";
    case GoalEnd::stalled:
      return "The jaws stand before their aim.";
    case GoalEnd::cancelled:
      return "The goal was cancelled.";
    case GoalEnd::preempted:
      return "Current goal preempted by new incoming action.";
    case GoalEnd::replaced:
      return "Another command for the same target replaced the goal.";
    case GoalEnd::path_tolerance:
      return "Aborted due to path tolerance violation: " + joint + " is " + amount +
             " off the path; allowed are " + limit + ".";
    case GoalEnd::goal_tolerance:
      return "Aborted due to goal_time_tolerance exceeding: " + joint + " is " + amount +
             " off the goal; allowed are " + limit + ".";
    case GoalEnd::refused:
      return "The trajectory cannot be followed from where the robot is: " + joint + " would have " + amount +
             "; its limit is " + limit + ".";
    case GoalEnd::past:
      return "The end of the trajectory was over when it took effect.";
    case GoalEnd::reset:
      return "The simulation was reset, ended or failed during the goal.";
  }
  return {};
}

void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::FollowJointTrajectory::Feedback& feedback) {
  const auto& joints = robot_of(cell, target).arm.joints;
  feedback.header.stamp = to_time(report.time_s);
  const auto n = static_cast<std::ptrdiff_t>(joints.size());
  const auto list = [n](const JointArray& values) {
    return std::vector<double>(values.begin(), values.begin() + n);
  };
  for (const JointModel& joint : joints) feedback.joint_names.push_back(joint.name);
  feedback.desired.positions = list(report.desired_position);
  feedback.desired.velocities = list(report.desired_velocity);
  feedback.desired.accelerations = list(report.desired_acceleration);
  feedback.actual.positions = list(report.position);
  feedback.actual.velocities = list(report.velocity);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    feedback.error.positions.push_back(report.desired_position[j] - report.position[j]);
    feedback.error.velocities.push_back(report.desired_velocity[j] - report.velocity[j]);
  }
  const auto since = to_stamp(to_nanoseconds(std::max(report.path_time_s, 0.0)));
  for (auto* point : {&feedback.desired, &feedback.actual, &feedback.error})
    point->time_from_start = {since.sec, since.nanosec};
}

void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::FollowJointTrajectory::Result& result) {
  const auto code = [&] {
    switch (report.end) {
      case GoalEnd::none:
      case GoalEnd::reached:
      case GoalEnd::stalled:
      case GoalEnd::cancelled:
        return TrajectoryError::successful;
      case GoalEnd::path_tolerance:
        return TrajectoryError::path_tolerance_violated;
      case GoalEnd::goal_tolerance:
        return TrajectoryError::goal_tolerance_violated;
      case GoalEnd::past:
        return TrajectoryError::old_header_timestamp;
      default:
        return TrajectoryError::invalid_goal;
    }
  };
  result.error_code = static_cast<std::int32_t>(code());
  result.error_string = text_of(report, cell, target);
}

void fill(const GoalReport& report, const CellDescription&, int, actions::GripperCmd::Feedback& feedback) {
  feedback.position = report.width_m;
  feedback.effort = report.force_N;
  feedback.stalled = report.end == GoalEnd::stalled;
  feedback.reached_goal = report.end == GoalEnd::reached;
}

void fill(const GoalReport& report, const CellDescription&, int, actions::GripperCmd::Result& result) {
  result.position = report.width_m;
  result.effort = report.force_N;
  result.stalled = report.end == GoalEnd::stalled;
  result.reached_goal = report.end == GoalEnd::reached;
}

void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::ParallelGripperCmd::Feedback& feedback) {
  feedback.state = jaw_state(report, cell, target);
}

void fill(const GoalReport& report, const CellDescription& cell, int target,
          actions::ParallelGripperCmd::Result& result) {
  result.state = jaw_state(report, cell, target);
  result.stalled = report.end == GoalEnd::stalled;
  result.reached_goal = report.end == GoalEnd::reached;
}

}  // namespace takt::ros
