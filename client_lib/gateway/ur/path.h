#pragma once
// Paths of a robot's moves, straight in joint space or of its tool, and the blends between them. Pure: no clock, no transport.
//
// A path is a function of its own coordinate s from 0 to 1. A blend goes past the point P where one path ends and the next
// begins: from the place at the radius r before P the robot brakes on the first path to P while it accelerates on the second
// one from P, and joins that at the radius r. With the ramp 3 u^2 - 2 u^3 of the duration T both ways are v T / 2 = r. Between
// two lines of directions d and e, at one speed v, that is
//
//   x(u) = P + v T (e h(u) - d h(1 - u)),  h(u) = u^3 - u^4 / 2:
//
// the velocity is v times a mean of d and e, the least distance to P is 3/16 r |e - d|, the largest acceleration
// 3/4 v^2 |e - d| / r. The curve of a real controller is not published; its ends are (UR, Script Manual e-Series, movel()).
#include <algorithm>
#include <array>
#include <optional>

#include "client_lib/kinematics/inverse_kinematics.h"
#include "client_lib/kinematics/motion_profile.h"

namespace takt::ur {

using Vector6 = std::array<double, 6>;

/// Pose of x, y, z (m) and rotation vector (rad), as the protocol writes it; and back.
Pose pose_of(const Vector6& values);
Vector6 vector_of(const Pose& X);
JointArray joint_array(const Vector6& q);
/// The largest magnitude among them.
double largest(const Vector6& values);
/// X_RT.
Pose tool_pose(const ArmModel& arm, const Pose& X_FT, const Vector6& q);

/// Accelerations and speeds of a motion; 0: the default of URScript's functions.
struct MoveOptions {
  double acceleration = 0.0;    ///< rad/s^2 of the joint with the longest way; m/s^2 of the tool
  double speed = 0.0;           ///< rad/s; m/s
  double duration_s = 0.0;      ///< 0: as acceleration and speed allow
  double blend_radius_m = 0.0;  ///< of the TCP, at the end; 0: an exact stop
};

/// Of optimovej and optimovel, whose acceleration and speed are fractions of what the robot can do: of 15 rad/s^2 and 3 rad/s
/// for a move of joints, of 1 m/s^2 and 1 m/s for a line.
inline MoveOptions optimised(MoveOptions fractions, bool joints) {
  constexpr double kLeast = 0.05, kJointAcceleration = 15.0, kJointSpeed = 3.0;
  fractions.acceleration = std::max(kLeast, fractions.acceleration) * (joints ? kJointAcceleration : 1.0);
  fractions.speed = std::max(kLeast, fractions.speed) * (joints ? kJointSpeed : 1.0);
  return fractions;
}

/// movej, movel or movec.
struct Move {
  enum class Kind : std::uint8_t { joints, line, arc };
  Kind kind = Kind::joints;
  Vector6 q{};              ///< end of `joints`
  Pose X_RT{}, X_RT_via{};  ///< end of the others; the place on the way of `arc`
  MoveOptions options{};
};

class MovePath {
 public:
  /// `arm` outlives it. Nothing where an end is out of reach, or the three points of an arc are on one line.
  static std::optional<MovePath> of(const ArmModel& arm, const Pose& X_FT, const Vector6& from,
                                    const Move& move);

  bool in_joint_space() const { return kind_ == Move::Kind::joints; }
  /// Joint positions at s; in: positions near them. False where the tool is out of reach.
  bool joints_at(double s, Vector6& q) const;
  Pose tool_at(double s) const;
  Pose tool_pose(const Vector6& q) const { return ur::tool_pose(*arm_, X_FT_, q); }
  /// Joint positions of a tool's pose, from positions near them.
  bool joints_for(const Pose& X_RT, Vector6& q) const;
  const ArmModel& arm() const { return *arm_; }
  const Vector6& start() const { return from_; }
  const Vector6& end() const { return to_; }
  Vector6 way() const;
  const MoveOptions& options() const { return options_; }
  /// Of the path coordinate: what the options ask for, within what the machine can do.
  const ProfileLimits& limits() const { return limits_; }
  /// The largest acceleration, in the unit of the options.
  double acceleration() const { return limits_.acceleration * length_; }
  /// From rest to rest.
  MotionProfile rest_to_rest(double cycle_s) const;
  /// The part of the path within `radius_m` of its start or end; nothing where that is all of it.
  std::optional<double> part_within(double radius_m, bool at_end) const;

 private:
  MovePath() = default;
  void limit(double speed, double acceleration);
  void limit_joints();
  void limit_tool(double length_m);
  Pose line_at(double s) const;

  const ArmModel* arm_ = nullptr;
  Pose X_FT_;
  Move::Kind kind_ = Move::Kind::joints;
  Vector6 from_{}, to_{};
  Pose start_;           ///< X_RT
  Vec3 turn_, end_p_;    ///< rotation vector from start to end, in R; end of a line
  Vec3 center_, axis_;   ///< of an arc
  double angle_ = 0.0;   ///< of an arc
  double length_ = 0.0;  ///< rad of the joint with the longest way; m
  MoveOptions options_;
  ProfileLimits machine_, limits_;
};

struct Blend {
  MovePath before, after;
  double part_before = 0.0, part_after = 0.0;  ///< of the paths: within the radius
  double duration_s = 0.0;

  /// Speeds of the path coordinates where the blend begins and ends.
  double speed_before() const { return 2.0 * part_before / duration_s; }
  double speed_after() const { return 2.0 * part_after / duration_s; }
  /// Joint positions at the part `u` of the duration; in: positions near them.
  bool joints_at(double u, Vector6& q) const;
  /// The shortest duration within the limits of both moves and of the joints; 0 where there is no way.
  double shortest_duration_s() const;
};

}  // namespace takt::ur
