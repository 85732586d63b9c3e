#pragma once
// The cell as a tree of frames for ROS 2 (tf2): `world`; below it every component under its own name, and the
// base of every robot as <robot>/<base link>; below that the robot's other links as <robot>/<link>, each
// below the link that the joint before it moves. Two robots of the same type keep their links apart by the
// prefix (the `frame_prefix` of robot_state_publisher, "TF Prefix" in rviz).
#include "ros2_msgs.h"
#include "server/simulation/cell_description.h"
#include "server/simulation/snapshot.h"

namespace takt {

inline constexpr const char* kWorldFrame = "world";

/// Name of the link of a robot that everything else hangs on, as a frame.
std::string base_frame(const RobotDescription& robot);

/// What never moves: bases of robots, links fixed to another link, Grounds (at their poses in `snapshot`).
tf2_msgs::msg::TFMessage static_frames(const CellDescription& cell, const Snapshot& snapshot);

/// What moves: links behind joints, and components other than Grounds.
class MovingFrames {
 public:
  explicit MovingFrames(const CellDescription& cell);
  /// Does not allocate.
  const tf2_msgs::msg::TFMessage& fill(const Snapshot& snapshot);
  tf2_msgs::msg::TFMessage& message() { return message_; }

 private:
  const CellDescription& cell_;
  tf2_msgs::msg::TFMessage message_;
};

}  // namespace takt
