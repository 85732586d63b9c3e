#pragma once
// takt::Arm: kinematics of one robot of a cell, and motions for Client::send_trajectory.
//
//   const auto description = cell.cell();
//   const takt::Arm arm(*description, "Robot1", "Gripper1");
//   const std::vector<double> here = cell.state().robot("Robot1").position;
//   takt::Pose X_WT = arm.forward_kinematics(here);
//   X_WT.p.z() += 0.1;                                             // 100 mm up, in the world
//   cell.send_trajectory("Robot1", arm.plan_line(here, X_WT));
//
// Frames: W world, R robot base, F flange, T tool centre point (TCP). X_WT is the pose of the TCP in the world.
// Joint positions are rad or m, in the order of the robot's description. Every error is a MotionError. But for
// set_base() an Arm does not change and may be used by several threads.
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/kinematics/motions.h"
#include "client_lib/kinematics/trajectory_point.h"
#include "takt_msgs.h"

namespace takt {

/// Joints and flange of a robot as the cell describes it. Throws MotionError for more than kMaxJoints joints.
ArmModel arm_model(const takt_msgs::msg::RobotDescription& robot);
/// The pose of a message.
Pose pose_of(const takt_msgs::msg::Transform& transform);
/// X_WR of a robot: as its description says; on a Ground, where this is in `state`.
Pose base_pose(const takt_msgs::msg::RobotDescription& robot, const takt_msgs::msg::CellState& state);
/// From the type of <takt/eigen.h>; no number changes its bits.
inline Pose pose_of(const Eigen::Isometry3d& X) {
  return {X.linear(), X.translation()};
}
/// To the type of <takt/eigen.h>; no number changes its bits.
inline Eigen::Isometry3d isometry_of(const Pose& X) {
  Eigen::Isometry3d made = Eigen::Isometry3d::Identity();
  made.linear() = X.R;
  made.translation() = X.p;
  return made;
}

/// Kinematics of one robot, and motions that it can follow.
class Arm {
 public:
  /// X_WR: base in the world; X_FT: TCP in the flange frame.
  Arm(std::string name, const ArmModel& model, const Pose& X_WR, const Pose& X_FT = {});
  /// A robot of a cell. The TCP is that of the gripper; without one it is the flange. Throws MotionError with
  /// the names that exist, and for a gripper that another robot carries.
  Arm(const takt_msgs::msg::CellDescription& cell, std::string_view robot, std::string_view gripper = {});

  /// A robot on a Ground moves with it: poses in the world count from where its base is in this state, for the next calls. For
  /// other robots nothing changes.
  void set_base(const takt_msgs::msg::CellState& state);
  const Pose& base() const { return X_WR_; }  ///< X_WR: of a robot on a Ground at the start, or of set_base()
  int mounted_on() const { return mounted_on_; }  ///< component id of that Ground, or -1

  const std::string& name() const { return name_; }          ///< of the robot
  const ArmModel& model() const { return *model_; }          ///< joints and flange
  int joint_count() const { return model_->joint_count(); }  ///< length of joint positions

  /// Pose of the TCP in the world. Positions outside the joints' ranges are allowed.
  Pose forward_kinematics(std::span<const double> positions) const;

  /// Joint positions within the joints' ranges that put the TCP at X_WT, exact to rounding (1e-12 m, 1e-12 rad). Of
  /// several solutions the one nearest to `near` is returned (the one whose largest joint travel is smallest). Throws
  /// MotionError with the distance of the best attempt if no solution is found, and for arms of fewer than six joints.
  std::vector<double> inverse_kinematics(const Pose& X_WT, std::span<const double> near) const;

  /// Motion from rest at `from` to rest at `to`; all joints start and stop together. One point for each
  /// `period_s`, without the start. Throws MotionError where `to` is outside a joint's range.
  std::vector<TrajectoryPoint> plan_joint_move(std::span<const double> from, std::span<const double> to,
                                               JointMotionOptions options = {},
                                               double period_s = kPeriod_s) const;
  /// Motion from rest at `from` to rest at X_WT. The TCP moves on a straight line and turns about one fixed
  /// axis; between two points it leaves the line by some nanometres, since joints move on cubic curves.
  /// Throws MotionError, with the place on the line, where the line leaves the reach, a joint's range or speed
  /// limit, or meets a singularity.
  std::vector<TrajectoryPoint> plan_line(std::span<const double> from, const Pose& X_WT,
                                         const LineOptions& options = {}, double period_s = kPeriod_s) const;

  /// The motion of plan_joint_move(), for a caller that samples it itself. The Arm must outlive it.
  JointMotion joint_motion(const JointArray& from, const JointArray& to, const JointMotionOptions& options,
                           double period_s) const {
    return {*model_, from, to, options, period_s};
  }
  /// The motion of plan_line().
  LineMotion line_motion(const JointArray& from, const Pose& X_WT, const LineOptions& options,
                         double period_s) const;

  static constexpr double kPeriod_s = 0.008;  ///< between two points of a motion, unless given

 private:
  JointArray joints(std::span<const double> values) const;
  void require_six_joints() const;

  std::string name_;
  std::shared_ptr<const ArmModel> model_;
  Pose X_WR_, X_FT_;
  int mounted_on_ = -1;
  Pose X_MR_;  ///< base in that Ground
};

}  // namespace takt
