// Commands off the wire, as they came in.
#include <algorithm>

#include "server/dds/convert_commands.h"

namespace takt {

Validated<double> from_stamp(const builtin_interfaces::msg::Time& stamp, const std::string& subject) {
  if (stamp.sec < 0 || stamp.nanosec >= 1'000'000'000U) {
    return Rejection{
        RejectionCode::malformed, subject,
        "the stamp of " + std::to_string(stamp.sec) + " s and " + std::to_string(stamp.nanosec) +
            " ns is no simulated time; seconds must not be negative, nanoseconds be below 1000000000"};
  }
  if (stamp.sec == 0 && stamp.nanosec == 0) return -1.0;
  return static_cast<double>(stamp.sec) + static_cast<double>(stamp.nanosec) * 1e-9;
}

Validated<RawJointCommand> from_message(const std::string& robot,
                                        const sensor_msgs::msg::JointState& message) {
  const auto stamp = from_stamp(message.header.stamp, robot);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  return RawJointCommand{
      robot, std::get<double>(stamp), message.name, message.position, message.velocity, message.effort};
}

Validated<RawGripperCommand> from_message(const std::string& gripper,
                                          const takt_msgs::msg::GripperCommand& message) {
  const auto stamp = from_stamp(message.stamp, gripper);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  return RawGripperCommand{gripper, std::get<double>(stamp), message.action, message.width,
                           message.max_force};
}

Validated<RawTrajectory> from_message(const std::string& robot,
                                      const trajectory_msgs::msg::JointTrajectory& message) {
  const auto stamp = from_stamp(message.header.stamp, robot);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  RawTrajectory raw{robot, std::get<double>(stamp), message.joint_names, {}};
  raw.points.reserve(std::min(message.points.size(), kMaxTrajectoryPoints + 1));
  for (const auto& point : message.points) {
    const auto& time = point.time_from_start;
    if (time.nanosec >= 1'000'000'000U) {
      return Rejection{RejectionCode::malformed, robot,
                       "the time of point " + std::to_string(raw.points.size() + 1) + " has " +
                           std::to_string(time.nanosec) + " ns; they must be below 1000000000"};
    }
    raw.points.push_back({point.positions, point.velocities, point.accelerations, point.effort,
                          static_cast<double>(time.sec) + static_cast<double>(time.nanosec) * 1e-9});
    if (raw.points.size() > kMaxTrajectoryPoints) break;  // validation says so
  }
  return raw;
}

Validated<RawDeviceCommand> from_message(const std::string& device,
                                         const takt_msgs::msg::DeviceCommand& message) {
  const auto stamp = from_stamp(message.stamp, device);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  return RawDeviceCommand{device, std::get<double>(stamp), message.signals, message.values};
}

}  // namespace takt
