#pragma once
// One robot as the controller drives it: the standing joint set-point and the motion under way.
//
// A motion begun at time t sends its set-point number k (k = 1, 2, ...) at t + (k - 1) periods, to be reached
// one period later, and is over at t + periods(): then the robot has arrived and the next motion may begin
// without a gap. Periods are counted by rounding elapsed time, so the last bits of a transmitted time do not
// matter.
#include <span>

#include "client_lib/controller/controller.h"
#include "client_lib/kinematics/arm.h"

namespace takt::controller {

class RobotDriver {
 public:
  explicit RobotDriver(Arm arm) : arm_(std::move(arm)) {}

  void set_period(double period_s) { period_s_ = period_s; }

  /// Stands at the given joint positions, one for each joint; ends any motion.
  void stand_at(std::span<const double> q);

  /// Of a robot on a Ground: the base is where it is in this state.
  void set_base(const takt_msgs::msg::CellState& state) { arm_.set_base(state); }
  int mounted_on() const { return arm_.mounted_on(); }

  /// Throw MotionError.
  void move_joints(const JointArray& q, const JointMotionOptions& options, double now_s);
  void move_to(const Pose& X_WT, const JointMotionOptions& options, double now_s);
  void move_line(const Pose& X_WT, const LineOptions& options, double now_s);

  /// Ends the motion if it is over at this time. True while the robot stands.
  bool arrived(double now_s);
  /// Set-point to be reached one period from now.
  const ArmSetPoint& advance(double now_s);

  const ArmModel& arm() const { return arm_.model(); }
  const std::string& name() const { return arm_.name(); }
  /// Joint positions and TCP in the world at the newest set-point.
  const JointArray& joints() const { return set_point_.position; }
  Pose X_WT() const { return tcp_at(used(set_point_.position)); }
  Pose tcp_at(std::span<const double> q) const { return arm_.forward_kinematics(q); }

 private:
  std::span<const double> used(const JointArray& q) const {
    return std::span(q).first(static_cast<std::size_t>(arm_.joint_count()));
  }
  void begin(const auto& motion, double now_s);
  long elapsed_periods(double now_s) const;
  void evaluate(long k);

  Arm arm_;
  double period_s_ = 0.0;
  double motion_start_s_ = 0.0;
  long motion_periods_ = 0;
  long sent_ = 0;  ///< number of the newest set-point of the motion
  Motion motion_;
  ArmSetPoint set_point_;
};

}  // namespace takt::controller
