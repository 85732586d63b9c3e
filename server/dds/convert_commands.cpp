// Commands off the wire, as they came in.
#include <algorithm>
#include <utility>

#include "server/dds/convert_commands.h"

namespace takt {

Validated<SimTime> from_stamp(const builtin_interfaces::msg::Time& stamp, const CellDescription& cell,
                              int target) {
  if (stamp.sec < 0 || stamp.nanosec >= 1'000'000'000U) {
    return Rejection{
        RejectionCode::malformed, std::string(target_name(cell, target)),
        "the stamp of " + std::to_string(stamp.sec) + " s and " + std::to_string(stamp.nanosec) +
            " ns is no simulated time; seconds must not be negative, nanoseconds be below 1000000000"};
  }
  if (stamp.sec == 0 && stamp.nanosec == 0) return SimTime{};
  return SimTime{std::int64_t{stamp.sec} * 1'000'000'000 + stamp.nanosec};
}

Validated<RawJointCommand> from_message(const CellDescription& cell, int target,
                                        sensor_msgs::msg::JointState&& message) {
  const auto stamp = from_stamp(message.header.stamp, cell, target);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  return RawJointCommand{std::get<SimTime>(stamp), std::move(message.name), std::move(message.position),
                         std::move(message.velocity), std::move(message.effort)};
}

Validated<RawGripperCommand> from_message(const CellDescription& cell, int target,
                                          takt_msgs::msg::GripperCommand&& message) {
  const auto stamp = from_stamp(message.stamp, cell, target);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  return RawGripperCommand{std::get<SimTime>(stamp), message.action, message.width, message.max_force};
}

Validated<RawTrajectory> from_message(const CellDescription& cell, int target,
                                      trajectory_msgs::msg::JointTrajectory&& message) {
  const auto stamp = from_stamp(message.header.stamp, cell, target);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  RawTrajectory raw{std::get<SimTime>(stamp), std::move(message.joint_names), {}};
  raw.points.reserve(std::min(message.points.size(), kMaxTrajectoryPoints + 1));
  for (auto& point : message.points) {
    const auto& time = point.time_from_start;
    if (time.nanosec >= 1'000'000'000U) {
      return Rejection{RejectionCode::malformed, std::string(target_name(cell, target)),
                       "the time of point " + std::to_string(raw.points.size() + 1) + " has " +
                           std::to_string(time.nanosec) + " ns; they must be below 1000000000"};
    }
    raw.points.push_back({std::move(point.positions), std::move(point.velocities),
                          std::move(point.accelerations), std::move(point.effort),
                          static_cast<double>(time.sec) + static_cast<double>(time.nanosec) * 1e-9});
    if (raw.points.size() > kMaxTrajectoryPoints) break;  // refused by the validation
  }
  return raw;
}

Validated<RawDeviceCommand> from_message(const CellDescription& cell, int target,
                                         takt_msgs::msg::DeviceCommand&& message) {
  const auto stamp = from_stamp(message.stamp, cell, target);
  if (const auto* rejection = std::get_if<Rejection>(&stamp)) return *rejection;
  return RawDeviceCommand{std::get<SimTime>(stamp), std::move(message.signals), std::move(message.values)};
}

}  // namespace takt
