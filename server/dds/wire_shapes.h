#pragma once
// What the samples that the server receives look like (wire_shape.h). To be included wherever readers of
// these types are made.
#include "idl/transport/fastdds/checked_type.h"
#include "ros2_msgsPubSubTypes.h"
#include "takt_msgsPubSubTypes.h"

namespace takt {

template <>
inline constexpr WireShape kWireShape<sensor_msgs::msg::JointStatePubSubType> = "44s[s][8][8][8]";
template <>
inline constexpr WireShape kWireShape<trajectory_msgs::msg::JointTrajectoryPubSubType> =
    "44s[s][[8][8][8][8]44]";
template <>
inline constexpr WireShape kWireShape<takt_msgs::msg::DeviceCommandPubSubType> = "44[s][8]";

}  // namespace takt
