#pragma once
// Received commands as raw commands. takt::validate decides on their validity.
#include <variant>

#include "ros2_msgs.h"
#include "server/simulation/model/command.h"
#include "takt_msgs.h"

namespace takt {

/// `target` (target_of()) is named in a rejection alone. Rejected are invalid nanoseconds and negative times.
Validated<SimTime> from_stamp(const builtin_interfaces::msg::Time& stamp, const CellDescription& cell,
                              int target);

/// Moves the content out of the message.
Validated<RawJointCommand> from_message(const CellDescription& cell, int target,
                                        sensor_msgs::msg::JointState&& message);
Validated<RawTrajectory> from_message(const CellDescription& cell, int target,
                                      trajectory_msgs::msg::JointTrajectory&& message);
Validated<RawDeviceCommand> from_message(const CellDescription& cell, int target,
                                         takt_msgs::msg::DeviceCommand&& message);
Validated<RawGripperCommand> from_message(const CellDescription& cell, int target,
                                          takt_msgs::msg::GripperCommand&& message);

}  // namespace takt
