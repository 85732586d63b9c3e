#include "client_lib/controller/robot_driver.h"

#include <algorithm>
#include <cmath>

namespace takt::controller {

void RobotDriver::stand_at(std::span<const double> q) {
  motion_ = std::monostate{};
  set_point_ = {};
  std::ranges::copy(q, set_point_.position.begin());
}

void RobotDriver::move_joints(const JointArray& q, const JointMotionOptions& options, double now_s) {
  begin(arm_.joint_motion(joints(), q, options, period_s_), now_s);
}

void RobotDriver::move_to(const Pose& X_WT, const JointMotionOptions& options, double now_s) {
  JointArray q{};
  std::ranges::copy(arm_.inverse_kinematics(X_WT, used(joints())), q.begin());
  move_joints(q, options, now_s);
}

void RobotDriver::move_line(const Pose& X_WT, const LineOptions& options, double now_s) {
  begin(arm_.line_motion(joints(), X_WT, options, period_s_), now_s);
}

void RobotDriver::begin(const auto& motion, double now_s) {
  motion_ = motion;
  motion_start_s_ = now_s;
  motion_periods_ = motion.periods();
  sent_ = 0;
}

bool RobotDriver::arrived(double now_s) {
  if (std::holds_alternative<std::monostate>(motion_)) return true;
  if (elapsed_periods(now_s) < motion_periods_) return false;
  if (sent_ < motion_periods_) evaluate(motion_periods_);  // the last update came late
  motion_ = std::monostate{};
  return true;
}

const ArmSetPoint& RobotDriver::advance(double now_s) {
  if (!std::holds_alternative<std::monostate>(motion_)) {
    const long k = std::min(elapsed_periods(now_s) + 1, motion_periods_);
    if (k > sent_) evaluate(k);
  }
  return set_point_;
}

long RobotDriver::elapsed_periods(double now_s) const {
  return std::lround((now_s - motion_start_s_) / period_s_);
}

void RobotDriver::evaluate(long k) {
  if (const auto* joint_motion = std::get_if<JointMotion>(&motion_)) {
    joint_motion->evaluate(k, set_point_);
  } else if (const auto* line_motion = std::get_if<LineMotion>(&motion_)) {
    line_motion->evaluate(k, set_point_);
  }
  sent_ = k;
}

}  // namespace takt::controller
