#include "client_lib/gateway/vendor_axes.h"

#include <algorithm>

namespace takt::gateway {

VendorAxes::VendorAxes(const CellInfo& cell, RobotMapping robot, const std::string& tool)
    : robot_(std::move(robot)) {
  const auto& description = cell.robots.at(static_cast<std::size_t>(cell.find_robot(robot_.robot)));
  std::vector<double> lower, upper;
  for (const auto& joint : description.joints) {
    lower.push_back(joint.lower);
    upper.push_back(joint.upper);
    fastest_.push_back(joint.max_velocity);
  }
  for (const std::size_t joint : robot_.index)
    unit_.push_back(description.joints[joint].type == JointType::prismatic ? 1e3 : degrees_of(1.0));
  lower_ = axes_of(lower);
  upper_ = axes_of(upper);
  for (std::size_t i = 0; i < lower_.size(); ++i)
    if (lower_[i] > upper_[i]) std::swap(lower_[i], upper_[i]);
  arm_ = std::make_unique<Arm>(cell, robot_.robot, tool);
  X_WR_ = takt::pose_of(description.base);
}

std::vector<double> VendorAxes::axes_of(std::span<const double> joints) const {
  std::vector<double> axes = robot_.to_protocol(joints);
  for (std::size_t i = 0; i < axes.size(); ++i) axes[i] *= unit_[i];
  return axes;
}

std::vector<double> VendorAxes::joints_of(std::span<const double> axes) const {
  std::vector<double> si(axes.begin(), axes.end());
  for (std::size_t i = 0; i < si.size(); ++i) si[i] /= unit_[i];
  return robot_.to_cell(si);
}

std::vector<double> VendorAxes::joint_rates_of(std::span<const double> axis_rates) const {
  std::vector<double> si(axis_rates.begin(), axis_rates.end());
  for (std::size_t i = 0; i < si.size(); ++i) si[i] /= unit_[i];
  return robot_.rates_to_cell(si);
}

std::vector<double> VendorAxes::limited(std::vector<double> joint_rates) const {
  for (std::size_t i = 0; i < joint_rates.size(); ++i)
    joint_rates[i] = std::clamp(joint_rates[i], -fastest_[i], fastest_[i]);
  return joint_rates;
}

Pose VendorAxes::pose_of(std::span<const double> axes) const {
  return X_WR_.inverse() * arm_->forward_kinematics(joints_of(axes));
}

std::optional<std::vector<double>> VendorAxes::axes_at(const Pose& X_RT, std::span<const double> near) const {
  try {
    return axes_of(arm_->inverse_kinematics(X_WR_ * X_RT, joints_of(near)));
  } catch (const MotionError&) {
    return std::nullopt;
  }
}

Six six_of(std::span<const double> values, std::size_t first) {
  Six six{};
  for (std::size_t i = 0; i < 6 && first + i < values.size(); ++i) six[i] = values[first + i];
  return six;
}

}  // namespace takt::gateway
