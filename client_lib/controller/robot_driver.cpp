#include "client_lib/controller/robot_driver.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "client_lib/controller/inverse_kinematics.h"

namespace takt::controller {

namespace {
void require_six_joints(const ArmModel& arm) {
  if (arm.joint_count() >= 6) return;
  throw std::runtime_error("the robot has " + std::to_string(arm.joint_count()) +
                           " joints; motion to a pose needs at least 6, use move_joints");
}
}  // namespace

void RobotDriver::stand_at(const JointArray& q) {
  motion_ = std::monostate{};
  set_point_ = {q, {}};
}

void RobotDriver::move_joints(const JointArray& q, const JointMotionOptions& options, double now_s) {
  const JointMotion motion(arm(), set_point_.position, q, options, period_s_);
  motion_ = motion;
  motion_start_s_ = now_s;
  motion_periods_ = motion.periods();
  sent_ = 0;
}

void RobotDriver::move_to(const Pose& X_WT, const JointMotionOptions& options, double now_s) {
  require_six_joints(arm());
  const Pose X_RF = robot_->X_WR.inverse() * X_WT * X_FT_.inverse();
  const IkSolution solution = solve_ik(arm(), X_RF, set_point_.position);
  if (!solution.found) {
    char residual[96];
    std::snprintf(residual, sizeof residual, "%.3g m and %.3g rad", solution.position_error_m,
                  solution.rotation_error_rad);
    throw std::runtime_error("the pose " + to_text(X_WT) +
                             " cannot be reached within the joints' ranges; the best attempt is short by " +
                             residual);
  }
  move_joints(solution.q, options, now_s);
}

void RobotDriver::move_line(const Pose& X_WT, const LineOptions& options, double now_s) {
  require_six_joints(arm());
  const Pose X_RT = robot_->X_WR.inverse() * X_WT;
  const LineMotion motion(arm(), X_FT_, set_point_.position, X_RT, options, period_s_);
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

Pose RobotDriver::tcp_at(const JointArray& q) const {
  ArmPoses poses;
  forward_kinematics(arm(), q.data(), poses);
  return robot_->X_WR * poses.X_RF * X_FT_;
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
