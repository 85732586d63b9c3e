#pragma once
// Received commands as raw commands. takt::validate decides on their validity.
#include <string_view>
#include <variant>

#include "ros2_msgs.h"
#include "server/simulation/model/command.h"
#include "takt_msgs.h"

namespace takt {

/// `target`: name of the robot, gripper or device, for a rejection. Rejected are invalid nanoseconds and
/// negative times.
Validated<SimTime> from_stamp(const builtin_interfaces::msg::Time& stamp, std::string_view target);

/// Moves the content out of the message.
Validated<RawJointCommand> from_message(std::string_view target, sensor_msgs::msg::JointState&& message);
Validated<RawTrajectory> from_message(std::string_view target,
                                      trajectory_msgs::msg::JointTrajectory&& message);
Validated<RawDeviceCommand> from_message(std::string_view target, takt_msgs::msg::DeviceCommand&& message);
Validated<RawGripperCommand> from_message(std::string_view target, takt_msgs::msg::GripperCommand&& message);

}  // namespace takt
