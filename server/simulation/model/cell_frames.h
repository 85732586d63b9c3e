#pragma once
// The cell as a tree of frames (as of tf2 of ROS 2): `world`; below it every component under its own name,
// and the base of every robot as <robot>/<base link>; below that the robot's other links as <robot>/<link>,
// each below the link that the joint before it moves. Two robots of the same type keep their links apart by
// the prefix (the `frame_prefix` of robot_state_publisher, "TF Prefix" in rviz).
#include <string>
#include <vector>

#include "idl/common/frames.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

/// Pose of a frame in its parent.
struct CellFrame {
  std::string parent, name;
  Vec3 p = Vec3::Zero();
  Quat q = Quat::Identity();
};

/// X_WR of a robot at this instant.
Pose base_pose(const RobotDescription& robot, const Snapshot& snapshot);

/// Frame name of a robot's base link, the root of its links.
std::string base_frame(const RobotDescription& robot);

/// Fixed frames: bases of robots, links fixed to another link, Grounds that stand (at their poses in `snapshot`).
std::vector<CellFrame> static_frames(const CellDescription& cell, const Snapshot& snapshot);

/// Moving frames: links behind joints, and components other than Grounds that stand. The description must outlive it.
class MovingFrames {
 public:
  explicit MovingFrames(const CellDescription& cell);
  /// Does not allocate.
  const std::vector<CellFrame>& fill(const Snapshot& snapshot);
  const std::vector<CellFrame>& frames() const { return frames_; }

 private:
  const CellDescription& cell_;
  std::vector<CellFrame> frames_;
};

}  // namespace takt
