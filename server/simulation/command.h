#pragma once
// What clients may ask of the plant: joint set-points and gripper commands, already validated against the
// cell.
//
// A command is fixed-size plain data, so that handing one over neither allocates nor locks for long. Commands
// are made only by the functions below, which check everything a sender can get wrong (interfaces.md,
// "Behaviour on the wire"): a command that exists is one the simulation may apply.
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"

namespace takt {

struct CellDescription;

/// Joint set-point of one robot: be at `position` with `velocity` one command period after the command takes
/// effect.
struct JointCommand {
  int robot = -1;             ///< index into CellDescription::robots
  double stamp_s = -1.0;      ///< simulated time the sender meant; negative: none given
  double period_s = 0.0;      ///< the sender's command period; 0: the robot's own (RobotDescription)
  bool has_velocity = false;  ///< velocities were sent; otherwise they follow from successive positions
  JointArray position{};      ///< rad or m, in the order of the robot's joints
  JointArray velocity{};      ///< rad/s or m/s
};

/// `open` lets go. `close` holds by the gripper's grasp rule. `width` sends the jaws to a width: a larger one
/// lets go; a smaller one holds only what both jaws touch, so that jaws can be set before a grip.
enum class GripperAction : std::uint8_t { open = 0, close = 1, width = 2 };

struct GripperCommand {
  int gripper = -1;       ///< index into CellDescription::grippers
  double stamp_s = -1.0;  ///< simulated time the sender meant; negative: none given
  GripperAction action = GripperAction::open;
  double width_m = 0.0;      ///< target of `width`; for `open` and `close` the stroke's ends are meant
  double max_force_N = 0.0;  ///< 0: the gripper's own limit
};

using Command = std::variant<JointCommand, GripperCommand>;

enum class RejectionCode : std::uint8_t {
  unknown_robot,
  unknown_gripper,
  unknown_joint,
  duplicate_joint,
  wrong_count,
  not_finite,
  out_of_range,
  velocity_out_of_range,
  effort_out_of_range,
  stale,
  not_owner,
  malformed,
  invalid_request,
};
std::string_view to_string(RejectionCode code);

/// Why a command was refused. `message` is a whole sentence with the joint, the value found and the allowed
/// range.
struct Rejection {
  RejectionCode code{};
  std::string subject;  ///< robot, gripper or topic
  std::string message;
};

/// A joint command as it came in, before validation: names select joints, in any order; all of the robot's
/// joints must be present. `velocity` and `effort` are empty or as long as `position`.
struct RawJointCommand {
  std::string robot;
  double stamp_s = -1.0;
  std::vector<std::string> names;
  std::vector<double> position, velocity, effort;
};

struct RawGripperCommand {
  std::string gripper;
  double stamp_s = -1.0;
  std::uint8_t action = 0;
  double width_m = 0.0;
  double max_force_N = 0.0;
};

/// Result of a validation: exactly one alternative.
template <typename T>
using Validated = std::variant<T, Rejection>;

Validated<JointCommand> validate(const CellDescription& cell, const RawJointCommand& raw);
Validated<GripperCommand> validate(const CellDescription& cell, const RawGripperCommand& raw);

}  // namespace takt
