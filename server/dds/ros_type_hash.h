#pragma once
// Type hashes (RIHS01, REP 2011) of the standard types of ROS 2 that takt speaks, as `ros2 topic info
// --verbose` shows them (Iron to Kilted). Nodes of these releases compare them and warn of endpoints without
// one.
#include <string_view>

namespace takt::ros_type_hash {

inline constexpr std::string_view kJointState =
    "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e";
inline constexpr std::string_view kJointTrajectory =
    "RIHS01_179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e";
inline constexpr std::string_view kString =
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
inline constexpr std::string_view kClock =
    "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564";
inline constexpr std::string_view kTFMessage =
    "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087";

}  // namespace takt::ros_type_hash
