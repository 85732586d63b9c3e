#include "server/dds/frames.h"

#include <string>

#include "server/dds/convert.h"

namespace takt {
namespace {

geometry_msgs::msg::TransformStamped frame(const std::string& parent, const std::string& name) {
  geometry_msgs::msg::TransformStamped result;
  result.header().frame_id(parent);
  result.child_frame_id(name);
  return result;
}

void place(geometry_msgs::msg::TransformStamped& frame, double time_s, const Vec3& p, const Quat& q) {
  frame.header().stamp(to_time(time_s));
  auto& transform = frame.transform();
  transform.translation().x(p.x());
  transform.translation().y(p.y());
  transform.translation().z(p.z());
  transform.rotation().x(q.x());
  transform.rotation().y(q.y());
  transform.rotation().z(q.z());
  transform.rotation().w(q.w());
}

void place(geometry_msgs::msg::TransformStamped& frame, double time_s, const Pose& X) {
  place(frame, time_s, X.p, X.quaternion());
}

std::string frame_of(const RobotDescription& robot, const RobotLink& link) {
  return robot.name + "/" + link.name;
}

/// The first link that a joint moves, or the base: where others that hang on the same joint are fixed.
const RobotLink& carrier(const RobotDescription& robot, int joint) {
  for (const RobotLink& link : robot.links)
    if (link.joint == joint) return link;
  return robot.links.front();
}

}  // namespace

std::string base_frame(const RobotDescription& robot) {
  return robot.links.empty() ? robot.name : frame_of(robot, robot.links.front());
}

tf2_msgs::msg::TFMessage static_frames(const CellDescription& cell, const Snapshot& snapshot) {
  tf2_msgs::msg::TFMessage message;
  auto& frames = message.transforms();
  for (const RobotDescription& robot : cell.robots) {
    place(frames.emplace_back(frame(kWorldFrame, base_frame(robot))), snapshot.time_s, robot.X_WR);
    for (const RobotLink& link : robot.links) {
      const RobotLink& on = carrier(robot, link.joint);
      if (&on == &link) continue;
      place(frames.emplace_back(frame(frame_of(robot, on), frame_of(robot, link))), snapshot.time_s,
            on.X_JL.inverse() * link.X_JL);
    }
  }
  for (std::size_t i = 0; i < cell.components.size(); ++i) {
    if (cell.components[i].type != ComponentType::ground) continue;
    const ComponentSample& sample = snapshot.components[i];
    place(frames.emplace_back(frame(kWorldFrame, cell.components[i].name)), snapshot.time_s, sample.p_WB,
          sample.q_WB);
  }
  return message;
}

MovingFrames::MovingFrames(const CellDescription& cell) : cell_(cell) {
  auto& frames = message_.transforms();
  for (const RobotDescription& robot : cell.robots) {
    for (int joint = 0; joint < robot.arm.joint_count() && !robot.links.empty(); ++joint) {
      frames.push_back(
          frame(frame_of(robot, carrier(robot, joint - 1)), frame_of(robot, carrier(robot, joint))));
    }
  }
  for (const ComponentDescription& component : cell.components)
    if (component.type != ComponentType::ground) frames.push_back(frame(kWorldFrame, component.name));
}

const tf2_msgs::msg::TFMessage& MovingFrames::fill(const Snapshot& snapshot) {
  std::size_t at = 0;
  auto& frames = message_.transforms();
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
      // The first joint's frame is given in the base, which the base link is.
      place(frames[at++], snapshot.time_s, joint.X_PJ * X);
    }
  }
  for (std::size_t i = 0; i < cell_.components.size(); ++i) {
    if (cell_.components[i].type == ComponentType::ground) continue;
    const ComponentSample& sample = snapshot.components[i];
    place(frames[at++], snapshot.time_s, sample.p_WB, sample.q_WB);
  }
  return message_;
}

}  // namespace takt
