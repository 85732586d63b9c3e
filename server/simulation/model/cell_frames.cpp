#include "server/simulation/model/cell_frames.h"

namespace takt {
namespace {

std::string frame_of(const RobotDescription& robot, const RobotLink& link) {
  return robot.name + "/" + link.name;
}

/// The first link that a joint moves, or the base: the parent of other links fixed to the same joint.
const RobotLink& carrier(const RobotDescription& robot, int joint) {
  for (const RobotLink& link : robot.links)
    if (link.joint == joint) return link;
  return robot.links.front();
}

}  // namespace

Pose base_pose(const RobotDescription& robot, const Snapshot& snapshot) {
  if (robot.mount < 0) return robot.X_WR;
  const ComponentSample& ground = snapshot.components[static_cast<std::size_t>(robot.mount)];
  return Pose::from_quaternion(ground.p_WB, ground.q_WB) * robot.X_MR;
}

std::string base_frame(const RobotDescription& robot) {
  return robot.links.empty() ? robot.name : frame_of(robot, robot.links.front());
}

std::vector<CellFrame> static_frames(const CellDescription& cell, const Snapshot& snapshot) {
  std::vector<CellFrame> frames;
  for (const RobotDescription& robot : cell.robots) {
    if (robot.mount < 0)
      frames.push_back({kWorldFrame, base_frame(robot), robot.X_WR.p, robot.X_WR.quaternion()});
    else
      frames.push_back({cell.components[static_cast<std::size_t>(robot.mount)].name, base_frame(robot),
                        robot.X_MR.p, robot.X_MR.quaternion()});
    for (const RobotLink& link : robot.links) {
      const RobotLink& on = carrier(robot, link.joint);
      if (&on == &link) continue;
      const Pose X = on.X_JL.inverse() * link.X_JL;
      frames.push_back({frame_of(robot, on), frame_of(robot, link), X.p, X.quaternion()});
    }
  }
  for (const DeviceDescription& device : cell.devices) {
    if (device.robot < 0) continue;
    const RobotDescription& robot = cell.robots[static_cast<std::size_t>(device.robot)];
    if (robot.links.empty()) continue;
    const RobotLink& on = carrier(robot, robot.arm.joint_count() - 1);
    const Pose X = on.X_JL.inverse() * robot.arm.X_JF * device.X_FD;
    frames.push_back({frame_of(robot, on), device.name, X.p, X.quaternion()});
  }
  for (std::size_t i = 0; i < cell.components.size(); ++i) {
    if (!cell.components[i].stands()) continue;
    const ComponentSample& sample = snapshot.components[i];
    frames.push_back({kWorldFrame, cell.components[i].name, sample.p_WB, sample.q_WB});
  }
  return frames;
}

MovingFrames::MovingFrames(const CellDescription& cell) : cell_(cell) {
  for (const RobotDescription& robot : cell.robots) {
    for (int joint = 0; joint < robot.arm.joint_count() && !robot.links.empty(); ++joint)
      frames_.push_back({frame_of(robot, carrier(robot, joint - 1)), frame_of(robot, carrier(robot, joint))});
  }
  for (const ComponentDescription& component : cell.components)
    if (!component.stands()) frames_.push_back({kWorldFrame, component.name});
}

const std::vector<CellFrame>& MovingFrames::fill(const Snapshot& snapshot) {
  std::size_t at = 0;
  for (std::size_t r = 0; r < cell_.robots.size(); ++r) {
    const RobotDescription& robot = cell_.robots[r];
    if (robot.links.empty()) continue;
    for (std::size_t j = 0; j < robot.arm.joints.size(); ++j) {
      const JointModel& joint = robot.arm.joints[j];
      const double q = snapshot.robots[r].position[j];
      Pose X;
      if (joint.type == JointType::revolute) {
        X.R = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
      } else {
        X.p = q * joint.axis;
      }
      // The first joint's frame is given in the base, as is the base link.
      X = joint.X_PJ * X;
      frames_[at].p = X.p;
      frames_[at++].q = X.quaternion();
    }
  }
  for (std::size_t i = 0; i < cell_.components.size(); ++i) {
    if (cell_.components[i].stands()) continue;
    const ComponentSample& sample = snapshot.components[i];
    frames_[at].p = sample.p_WB;
    frames_[at++].q = sample.q_WB;
  }
  return frames_;
}

}  // namespace takt
