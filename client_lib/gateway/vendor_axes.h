#pragma once
// A robot of the cell in the axes and units of a vendor: degrees and millimetres, poses of the tool in the robot's base.
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_lib/gateway/mapping.h"
#include "client_lib/gateway/vendor_units.h"
#include "client_lib/kinematics/arm.h"

namespace takt::gateway {

class VendorAxes {
 public:
  /// `tool`: a gripper whose tool centre point is the tool; empty: the flange. Throws MotionError.
  VendorAxes(const CellInfo& cell, RobotMapping robot, const std::string& tool);

  std::size_t count() const { return robot_.index.size(); }
  const std::string& robot() const { return robot_.robot; }
  /// Positions of the cell's joints as axes, and back.
  std::vector<double> axes_of(std::span<const double> joints) const;
  std::vector<double> joints_of(std::span<const double> axes) const;
  /// Velocities.
  std::vector<double> joint_rates_of(std::span<const double> axis_rates) const;
  /// Within the speed limits of the joints: of a set-point's velocity, which the server refuses beyond them.
  std::vector<double> limited(std::vector<double> joint_rates) const;
  /// Limits of the axes.
  const std::vector<double>& lower() const { return lower_; }
  const std::vector<double>& upper() const { return upper_; }

  /// Poses need a robot of six joints or more.
  bool has_poses() const { return count() >= 6; }
  Pose pose_of(std::span<const double> axes) const;
  /// The axes nearest to `near` that put the tool at the pose; empty: out of reach.
  std::optional<std::vector<double>> axes_at(const Pose& X_RT, std::span<const double> near) const;

 private:
  RobotMapping robot_;
  std::vector<double> unit_;  ///< of each axis: degrees per rad, or mm per m
  std::vector<double> lower_, upper_, fastest_;
  std::unique_ptr<Arm> arm_;
  Pose X_WR_;
};

/// Puts `values` into six axes; the rest is 0.
Six six_of(std::span<const double> values, std::size_t first = 0);

}  // namespace takt::gateway
