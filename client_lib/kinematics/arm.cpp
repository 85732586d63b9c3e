#include "client_lib/kinematics/arm.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client_lib/kinematics/inverse_kinematics.h"
#include "idl/common/eigen_messages.h"
#include "idl/common/text.h"

namespace takt {
namespace {

template <typename Described>
int index_of(const std::vector<Described>& items, std::string_view name, const char* kind) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].name == name) return static_cast<int>(i);
  throw NameError(std::string("The cell has no ") + kind + " '" + std::string(name) + "'; it has " +
                  list_names(items) + ".");
}

/// Largest speed on the cubic through two points, over the joint's limit; largest of all joints.
double speed_ratio(const ArmModel& arm, const TrajectoryPoint& a, const TrajectoryPoint& b, int& joint) {
  const double h = b.time_s - a.time_s;
  double largest = 0.0;
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const double v0 = a.velocities[j], v1 = b.velocities[j];
    const double mean = (b.positions[j] - a.positions[j]) / h;
    // v(u) = v0 + 2 (3 mean - 2 v0 - v1) u + 3 (v0 + v1 - 2 mean) u^2.
    const double slope = 3.0 * mean - 2.0 * v0 - v1, bend = 3.0 * (v0 + v1 - 2.0 * mean);
    double speed = std::max(std::abs(v0), std::abs(v1));
    const double u = bend == 0.0 ? 0.0 : -slope / bend;
    if (u > 0.0 && u < 1.0) speed = std::max(speed, std::abs(v0 + slope * u));
    const double ratio = speed / arm.joints[j].max_velocity;
    if (ratio <= largest) continue;
    largest = ratio;
    joint = static_cast<int>(j);
  }
  return largest;
}

template <typename Motion>
std::vector<TrajectoryPoint> sampled(const Motion& motion, const JointArray& from, int joint_count,
                                     double period_s) {
  const auto used = [&](const JointArray& values) {
    return std::vector<double>(values.begin(), values.begin() + joint_count);
  };
  std::vector<TrajectoryPoint> points;
  ArmSetPoint set_point{from, {}};
  for (long k = 1; k <= motion.periods(); ++k) {
    motion.evaluate(k, set_point);
    points.push_back({static_cast<double>(k) * period_s, used(set_point.position), used(set_point.velocity)});
  }
  return points;
}

/// Speed over limit, where it is largest on the whole way.
struct Peak {
  double ratio = 0.0;
  int joint = 0;
  double time_s = 0.0;
};

Peak fastest(const ArmModel& arm, const JointArray& from, const std::vector<TrajectoryPoint>& points) {
  Peak peak;
  const std::size_t n = arm.joints.size();
  TrajectoryPoint before{
      0.0, {from.begin(), from.begin() + static_cast<std::ptrdiff_t>(n)}, std::vector<double>(n, 0.0)};
  for (const TrajectoryPoint& point : points) {
    int joint = 0;
    if (const double ratio = speed_ratio(arm, before, point, joint); ratio > peak.ratio)
      peak = {ratio, joint, point.time_s};
    before = point;
  }
  return peak;
}

void require_period(double period_s) {
  if (!(period_s > 0.0) || !std::isfinite(period_s))
    throw MotionError("period_s = " + number_text(period_s) +
                      " is not allowed; it is the time from point to point, greater than 0");
}

Pose component_pose(const takt_msgs::msg::CellState& state, int component) {
  const auto& found = state.components.at(static_cast<std::size_t>(component));
  return Pose::from_quaternion(to_eigen(found.position), to_eigen(found.orientation));
}

}  // namespace

Pose pose_of(const takt_msgs::msg::Transform& transform) {
  return {to_eigen(transform.rotation), to_eigen(transform.position)};
}

ArmModel arm_model(const takt_msgs::msg::RobotDescription& robot) {
  if (robot.joints.size() > static_cast<std::size_t>(kMaxJoints))
    throw MotionError("robot '" + robot.name + "' has " + std::to_string(robot.joints.size()) +
                      " joints; allowed are at most " + std::to_string(kMaxJoints));
  ArmModel arm;
  for (const auto& joint : robot.joints)
    arm.joints.push_back({joint.name, joint.type, pose_of(joint.origin), to_eigen(joint.axis), joint.lower,
                          joint.upper, joint.max_velocity, joint.max_effort});
  arm.X_JF = pose_of(robot.flange);
  return arm;
}

Pose base_pose(const takt_msgs::msg::RobotDescription& robot, const takt_msgs::msg::CellState& state) {
  if (robot.mounted_on < 0) return pose_of(robot.base);
  return component_pose(state, robot.mounted_on) * pose_of(robot.mount);
}

Arm::Arm(std::string name, const ArmModel& model, const Pose& X_WR, const Pose& X_FT)
    : name_(std::move(name)), model_(std::make_shared<const ArmModel>(model)), X_WR_(X_WR), X_FT_(X_FT) {}

Arm::Arm(const takt_msgs::msg::CellDescription& cell, std::string_view robot, std::string_view gripper)
    : name_(robot) {
  const int index = index_of(cell.robots, robot, "robot");
  const auto& described = cell.robots[static_cast<std::size_t>(index)];
  model_ = std::make_shared<const ArmModel>(arm_model(described));
  X_WR_ = pose_of(described.base);
  mounted_on_ = described.mounted_on;
  X_MR_ = pose_of(described.mount);
  if (gripper.empty()) return;
  const auto& tool = cell.grippers[static_cast<std::size_t>(index_of(cell.grippers, gripper, "gripper"))];
  if (tool.robot != index) throw NameError("Gripper '" + tool.name + "' is not on robot '" + name_ + "'.");
  X_FT_ = pose_of(tool.mount) * pose_of(tool.tool_center_point);
}

void Arm::set_base(const takt_msgs::msg::CellState& state) {
  if (mounted_on_ >= 0) X_WR_ = component_pose(state, mounted_on_) * X_MR_;
}

JointArray Arm::joints(std::span<const double> values) const {
  if (values.size() != model_->joints.size())
    throw ShapeError("robot '" + name_ + "' has " + std::to_string(joint_count()) + " joints (" +
                     list_names(model_->joints) + "); " + std::to_string(values.size()) +
                     " positions are given");
  JointArray q{};
  std::copy(values.begin(), values.end(), q.begin());
  return q;
}

void Arm::require_six_joints() const {
  if (joint_count() >= 6) return;
  throw MotionError("the robot has " + std::to_string(joint_count()) +
                    " joints; motion to a pose needs at least 6, use a joint motion");
}

Pose Arm::forward_kinematics(std::span<const double> positions) const {
  const JointArray q = joints(positions);
  ArmPoses poses;
  takt::forward_kinematics(*model_, q.data(), poses);
  return X_WR_ * poses.X_RF * X_FT_;
}

std::vector<double> Arm::inverse_kinematics(const Pose& X_WT, std::span<const double> near) const {
  const JointArray seed = joints(near);
  require_six_joints();
  const IkSolution solution = solve_ik(*model_, X_WR_.inverse() * X_WT * X_FT_.inverse(), seed);
  if (!solution.found) {
    char residual[96];
    std::snprintf(residual, sizeof residual, "%.3g m and %.3g rad", solution.position_error_m,
                  solution.rotation_error_rad);
    throw MotionError("the pose " + to_text(X_WT) +
                      " cannot be reached within the joints' ranges; the best attempt is short by " +
                      residual);
  }
  return {solution.q.begin(), solution.q.begin() + joint_count()};
}

LineMotion Arm::line_motion(const JointArray& from, const Pose& X_WT, const LineOptions& options,
                            double period_s) const {
  require_six_joints();
  return {*model_, X_FT_, from, X_WR_.inverse() * X_WT, options, period_s};
}

std::vector<TrajectoryPoint> Arm::plan_joint_move(std::span<const double> from, std::span<const double> to,
                                                  JointMotionOptions options, double period_s) const {
  require_period(period_s);
  const JointArray start = joints(from), end = joints(to);
  for (;;) {
    std::vector<TrajectoryPoint> points =
        sampled(joint_motion(start, end, options, period_s), start, joint_count(), period_s);
    // A cubic between two points may be faster than either of them.
    const double ratio = fastest(*model_, start, points).ratio;
    if (ratio <= 1.0) return points;
    options.speed /= ratio * kSpeedRounding;
  }
}

std::vector<TrajectoryPoint> Arm::plan_line(std::span<const double> from, const Pose& X_WT,
                                            const LineOptions& options, double period_s) const {
  require_period(period_s);
  const JointArray start = joints(from);
  std::vector<TrajectoryPoint> points =
      sampled(line_motion(start, X_WT, options, period_s), start, joint_count(), period_s);
  if (const Peak peak = fastest(*model_, start, points); peak.ratio > kSpeedRounding)
    throw MotionError("joint " + model_->joints[static_cast<std::size_t>(peak.joint)].name +
                      ": the straight line needs " + number_text(peak.ratio, 6) +
                      " times the joint's largest speed at " + number_text(peak.time_s) +
                      " s; go slower or further away from the singularity");
  return points;
}

}  // namespace takt
