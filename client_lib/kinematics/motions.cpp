#include "client_lib/kinematics/motions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "client_lib/kinematics/inverse_kinematics.h"
#include "idl/common/text.h"

namespace takt {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string number(double value) {
  return number_text(value + 0.0, 6);  // adding zero makes -0 plain 0
}

void require_positive(const char* name, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw MotionError(std::string(name) + " = " + number(value) +
                      " is not allowed; it must be greater than 0");
  }
}

MotionProfile make_profile(const ProfileLimits& limits, double duration_s, double period_s) {
  const MotionProfile fastest = MotionProfile::fastest(limits, period_s);
  if (duration_s == 0.0) return fastest;
  require_positive("duration_s", duration_s);
  const std::optional<MotionProfile> profile = MotionProfile::lasting(duration_s, limits, period_s);
  if (!profile) {
    throw MotionError("duration_s = " + number(duration_s) +
                      " is too short; the speed and acceleration limits " + "allow no less than " +
                      number(fastest.duration_s()) + " s");
  }
  return *profile;
}

MotionProfile joint_profile(const ArmModel& arm, const JointArray& from, const JointArray& to,
                            const JointMotionOptions& options, double period_s) {
  if (!(options.speed > 0.0) || !(options.speed <= 1.0)) {
    throw MotionError("speed = " + number(options.speed) +
                      " is not allowed; it is the fraction of the joints' own limits, in (0, 1]");
  }
  require_positive("acceleration_rad_per_s2", options.acceleration_rad_per_s2);
  ProfileLimits limits{kInfinity, kInfinity};
  for (int i = 0; i < arm.joint_count(); ++i) {
    const auto j = static_cast<size_t>(i);
    const double distance = std::abs(to[j] - from[j]);
    if (distance == 0.0) continue;
    limits.speed = std::min(limits.speed, options.speed * arm.joints[j].max_velocity / distance);
    limits.acceleration = std::min(limits.acceleration, options.acceleration_rad_per_s2 / distance);
  }
  return make_profile(limits, options.duration_s, period_s);
}

MotionProfile line_profile(double length_m, double angle_rad, const LineOptions& options, double period_s) {
  require_positive("speed_m_per_s", options.speed_m_per_s);
  require_positive("acceleration_m_per_s2", options.acceleration_m_per_s2);
  require_positive("rotation_speed_rad_per_s", options.rotation_speed_rad_per_s);
  require_positive("rotation_acceleration_rad_per_s2", options.rotation_acceleration_rad_per_s2);
  ProfileLimits limits{kInfinity, kInfinity};
  const auto limit = [&limits](double way, double speed, double acceleration) {
    if (way <= 1e-12) return;
    limits.speed = std::min(limits.speed, speed / way);
    limits.acceleration = std::min(limits.acceleration, acceleration / way);
  };
  limit(length_m, options.speed_m_per_s, options.acceleration_m_per_s2);
  limit(angle_rad, options.rotation_speed_rad_per_s, options.rotation_acceleration_rad_per_s2);
  return make_profile(limits, options.duration_s, period_s);
}

Pose flange_to_tcp(const ArmModel& arm, const JointArray& q, const Pose& X_FT) {
  ArmPoses poses;
  forward_kinematics(arm, q.data(), poses);
  return poses.X_RF * X_FT;
}

}  // namespace

void check_joint_limits(const ArmModel& arm, const JointArray& q) {
  for (int i = 0; i < arm.joint_count(); ++i) {
    const auto j = static_cast<size_t>(i);
    const JointModel& joint = arm.joints[j];
    if (q[j] >= joint.lower && q[j] <= joint.upper) continue;
    const char* unit = joint.type == JointType::revolute ? " rad" : " m";
    throw MotionError("joint " + joint.name + ": position " + number(q[j]) + unit + " is outside [" +
                      number(joint.lower) + ", " + number(joint.upper) + "]" + unit);
  }
}

std::string to_text(const Pose& X) {
  const double roll = std::atan2(X.R(2, 1), X.R(2, 2));
  const double pitch = std::atan2(-X.R(2, 0), std::hypot(X.R(0, 0), X.R(1, 0)));
  const double yaw = std::atan2(X.R(1, 0), X.R(0, 0));
  return "{x=" + number(X.p.x()) + ", y=" + number(X.p.y()) + ", z=" + number(X.p.z()) +
         ", roll=" + number(roll) + ", pitch=" + number(pitch) + ", yaw=" + number(yaw) + "}";
}

JointMotion::JointMotion(const ArmModel& arm, const JointArray& from, const JointArray& to,
                         const JointMotionOptions& options, double period_s)
    : joint_count_(arm.joint_count()),
      from_(from),
      to_(to),
      profile_(joint_profile(arm, from, to, options, period_s)) {
  check_joint_limits(arm, to);
}

void JointMotion::evaluate(long k, ArmSetPoint& set_point) const {
  if (k >= profile_.periods()) {
    set_point.position = to_;
    set_point.velocity = {};
    return;
  }
  const MotionProfile::Sample sample = profile_.at_period(k);
  for (int i = 0; i < joint_count_; ++i) {
    const auto j = static_cast<size_t>(i);
    const double way = to_[j] - from_[j];
    set_point.position[j] = from_[j] + sample.s * way;
    set_point.velocity[j] = sample.speed * way;
  }
}

LineMotion::LineMotion(const ArmModel& arm, const Pose& X_FT, const JointArray& from, const Pose& X_RT_end,
                       const LineOptions& options, double period_s)
    : arm_(&arm),
      X_TF_(X_FT.inverse()),
      X_RT_start_(flange_to_tcp(arm, from, X_FT)),
      X_RT_end_(X_RT_end),
      turn_R_(rotation_vector(X_RT_end.R * X_RT_start_.R.transpose())),
      period_s_(period_s),
      profile_(line_profile((X_RT_end.p - X_RT_start_.p).norm(), turn_R_.norm(), options, period_s)) {
  constexpr long kLooks = 16;
  ArmSetPoint set_point{from, {}};
  for (long look = 1; look <= kLooks; ++look) {
    const double part = static_cast<double>(look) / static_cast<double>(kLooks);
    follow(look == kLooks ? profile_.at_period(profile_.periods())
                          : profile_.at_time(part * profile_.duration_s()),
           set_point);
  }
}

void LineMotion::evaluate(long k, ArmSetPoint& set_point) const {
  const MotionProfile::Sample sample = profile_.at_period(k);
  // Where the arm would be at constant joint velocity: Newton's method then needs one or two steps.
  for (int i = 0; i < arm_->joint_count(); ++i) {
    const auto j = static_cast<size_t>(i);
    set_point.position[j] = std::clamp(set_point.position[j] + period_s_ * set_point.velocity[j],
                                       arm_->joints[j].lower, arm_->joints[j].upper);
  }
  follow(sample, set_point);
}

void LineMotion::follow(const MotionProfile::Sample& sample, ArmSetPoint& set_point) const {
  Pose X_RT = X_RT_end_;
  const double angle = turn_R_.norm();
  if (sample.s < 1.0) {
    X_RT.p = X_RT_start_.p + sample.s * (X_RT_end_.p - X_RT_start_.p);
    X_RT.R =
        angle > 0.0
            ? Mat3(Eigen::AngleAxisd(sample.s * angle, turn_R_ / angle).toRotationMatrix() * X_RT_start_.R)
            : X_RT_start_.R;
  }
  const Pose X_RF = X_RT * X_TF_;
  const IkSolution solution = solve_ik_from(*arm_, X_RF, set_point.position);
  if (!solution.found) {
    throw MotionError("the straight line cannot be followed at " + number(100.0 * sample.s) +
                      " % of its way, TCP in the robot's base frame " + to_text(X_RT) +
                      ": no joint positions near the present ones within the joints' ranges (short by " +
                      number(solution.position_error_m) + " m and " + number(solution.rotation_error_rad) +
                      " rad)");
  }
  set_point.position = solution.q;
  if (sample.speed == 0.0) {
    set_point.velocity = {};
    return;
  }
  Twist V_RF;
  V_RF.w = sample.speed * turn_R_;
  V_RF.v = sample.speed * (X_RT_end_.p - X_RT_start_.p) + V_RF.w.cross(X_RF.p - X_RT.p);
  ArmPoses poses;
  forward_kinematics(*arm_, set_point.position.data(), poses);
  if (!joint_velocities(*arm_, poses, V_RF, set_point.velocity)) {
    throw MotionError("the straight line meets a singularity of the arm at " + number(100.0 * sample.s) +
                      " % of its way, TCP in the robot's base frame " + to_text(X_RT) +
                      "; choose another way or use move_to");
  }
  for (int i = 0; i < arm_->joint_count(); ++i) {
    const auto j = static_cast<size_t>(i);
    const JointModel& joint = arm_->joints[j];
    if (std::abs(set_point.velocity[j]) <= joint.max_velocity * kSpeedRounding) continue;
    const char* unit = joint.type == JointType::revolute ? " rad/s" : " m/s";
    throw MotionError("joint " + joint.name + ": the straight line needs " +
                      number(std::abs(set_point.velocity[j])) + unit + " at " + number(100.0 * sample.s) +
                      " % of its way, allowed are " + number(joint.max_velocity) + unit +
                      "; go slower or further away from the singularity");
  }
}

}  // namespace takt
