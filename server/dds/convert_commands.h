#pragma once
// Commands off the wire as they came in. What is wrong with a command is decided by takt::validate.
#include <string>
#include <variant>

#include "ros2_msgs.h"
#include "server/simulation/model/command.h"
#include "takt_msgs.h"

namespace takt {

/// A stamp of zero means "none given" (-1). Rejection: nanoseconds that are none, or a time before 0.
Validated<double> from_stamp(const builtin_interfaces::msg::Time& stamp, const std::string& subject);

Validated<RawJointCommand> from_message(const std::string& robot,
                                        const sensor_msgs::msg::JointState& message);
Validated<RawTrajectory> from_message(const std::string& robot,
                                      const trajectory_msgs::msg::JointTrajectory& message);
Validated<RawDeviceCommand> from_message(const std::string& device,
                                         const takt_msgs::msg::DeviceCommand& message);
Validated<RawGripperCommand> from_message(const std::string& gripper,
                                          const takt_msgs::msg::GripperCommand& message);

}  // namespace takt
