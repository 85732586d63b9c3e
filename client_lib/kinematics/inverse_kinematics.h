#pragma once
// Inverse kinematics of any serial arm with at least six joints, by Newton's method on the geometric
// Jacobian, damped far from the solution (Nakamura and Hanafusa 1986; damping by the size of the error:
// Sugihara 2011).
//
// Frames as in arm_kinematics.h: R robot base, F flange. Errors are those of the flange: distance in m, angle
// in rad.
#include "plant_models/robot/arm_kinematics.h"

namespace takt {

/// A pose counts as reached within these. About a thousand times what double precision gives for arms of some
/// metres.
inline constexpr double kIkPositionTolerance_m = 1e-12;
/// See kIkPositionTolerance_m.
inline constexpr double kIkRotationTolerance_rad = 1e-12;

/// Joint positions for a pose, or the best attempt.
struct IkSolution {
  bool found = false;               ///< both residuals are within the tolerances
  JointArray q{};                   ///< where found, within the joint limits; otherwise the best attempt
  double position_error_m = 0.0;    ///< residual
  double rotation_error_rad = 0.0;  ///< residual
};

/// Rotation vector (axis times angle, at most pi) of R, with the axis in the frame R maps to.
Vec3 rotation_vector(const Mat3& R);

/// The solution that Newton's method reaches from `seed`; further joints than six follow the smallest motion.
/// Joint positions stay within the arm's limits. For tracking: no other configuration is tried.
IkSolution solve_ik_from(const ArmModel& arm, const Pose& X_RF, const JointArray& seed);

/// The configuration nearest to `seed` (smallest largest joint travel) among those found from the seed itself
/// and, where that fails, from a fixed set of other starts. Revolute joints are taken on the turn nearest to
/// the seed.
IkSolution solve_ik(const ArmModel& arm, const Pose& X_RF, const JointArray& seed);

/// Joint velocities (the smallest ones) that give the flange the twist `V_RF` at the poses of
/// forward_kinematics(). Returns false where the arm is singular: the Jacobian has not full rank to working
/// precision.
bool joint_velocities(const ArmModel& arm, const ArmPoses& poses, const Twist& V_RF, JointArray& qd);

}  // namespace takt
