#pragma once
// Motions of one arm from rest to rest: synchronised joint motion, and a straight line of the tool centre
// point.
//
// Frames: R robot base, F flange, T tool centre point (TCP). Both motions yield, for period k, the joint
// set-point at the end of that period: position and its exact time derivative. All errors are
// MotionError without a place; the caller knows the line of the program.
#include <stdexcept>
#include <string>
#include <variant>

#include "client_lib/kinematics/motion_profile.h"
#include "plant_models/robot/arm_kinematics.h"

namespace takt {

/// A motion or pose that does not exist. The sentence has the request and the allowed values.
class MotionError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// No robot or gripper of that name.
class NameError : public MotionError {
  using MotionError::MotionError;
};
/// An argument that is no pose of space or no position of all joints.
class ShapeError : public MotionError {
  using MotionError::MotionError;
};

/// How far a velocity may exceed its limit by rounding alone, as a factor.
inline constexpr double kSpeedRounding = 1.0 + 1e-9;

/// Limits of a joint motion.
struct JointMotionOptions {
  double speed = 0.5;                    ///< fraction of every joint's own limit, (0, 1]
  double acceleration_rad_per_s2 = 2.0;  ///< of every joint; m/s^2 for prismatic joints
  double duration_s = 0.0;               ///< 0: as fast as the limits allow
};

/// Limits of a straight line.
struct LineOptions {
  double speed_m_per_s = 0.2;                     ///< of the TCP
  double acceleration_m_per_s2 = 0.5;             ///< of the TCP
  double rotation_speed_rad_per_s = 0.5;          ///< of the orientation of the TCP
  double rotation_acceleration_rad_per_s2 = 1.0;  ///< of the orientation of the TCP
  double duration_s = 0.0;                        ///< 0: as fast as the limits allow
};

/// Set-point of all joints.
struct ArmSetPoint {
  JointArray position{};  ///< rad, m
  JointArray velocity{};  ///< rad/s, m/s
};

/// Throws where a position is outside the limits of its joint; names joint, value and range.
void check_joint_limits(const ArmModel& arm, const JointArray& q);

/// Text for people: position in m, roll, pitch, yaw in rad (fixed axes).
std::string to_text(const Pose& X);

/// All joints start and stop together.
class JointMotion {
 public:
  /// The fastest motion within the options and the limits of the joints, or one of the given duration.
  JointMotion(const ArmModel& arm, const JointArray& from, const JointArray& to,
              const JointMotionOptions& options, double period_s);
  long periods() const { return profile_.periods(); }  ///< number of the last period
  /// Set-point at the end of period k.
  void evaluate(long k, ArmSetPoint& set_point) const;

 private:
  int joint_count_;
  JointArray from_, to_;
  MotionProfile profile_;
};

/// The TCP moves on a straight line while its orientation turns about one fixed axis. The constructor checks samples of
/// the line and throws where the line leaves the reach, a joint's range or speed limit, or meets a singularity. Every
/// period is checked again.
class LineMotion {
 public:
  /// X_RT_end: target of the TCP. `from` are the joint positions at the start.
  LineMotion(const ArmModel& arm, const Pose& X_FT, const JointArray& from, const Pose& X_RT_end,
             const LineOptions& options, double period_s);
  long periods() const { return profile_.periods(); }  ///< number of the last period
  /// Set-point at the end of period k, by Newton's method from the set-point given (that of an earlier
  /// period).
  void evaluate(long k, ArmSetPoint& set_point) const;

 private:
  void follow(const MotionProfile::Sample& sample, ArmSetPoint& set_point) const;

  const ArmModel* arm_;
  Pose X_TF_;
  Pose X_RT_start_, X_RT_end_;
  Vec3 turn_R_;  ///< rotation vector from start to end, in R
  double period_s_;
  MotionProfile profile_;
};

using Motion = std::variant<std::monostate, JointMotion, LineMotion>;

}  // namespace takt
