#pragma once
// A commanded motion of all joints of a robot: points with positions, optional velocities and optional
// accelerations, joined piece by piece by polynomials: linear through positions alone, cubic (Hermite) with
// velocities, quintic with accelerations too; optional torques for the drives are interpolated linearly from
// point to point. Positions in rad or m, torques in N m or N, times in s.
#include <array>
#include <cstdint>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"

namespace takt {

enum class PathOrder : std::uint8_t { linear = 1, cubic = 3, quintic = 5 };

struct JointPathPoint {
  double t = 0.0;  ///< from the start of the path
  JointArray q{}, qd{}, qdd{};
  JointArray feed_forward{};  ///< torques at the joints; zero for a path without torques
};

/// One joint between two points: a polynomial in u, from 0 to 1.
struct PathPiece {
  std::array<double, 6> c{};  ///< of 1, u, ... u^5
  double duration_s = 1.0;

  double position(double u) const;
  double velocity(double u) const;
  PathPiece derivative() const;  ///< velocity as a polynomial in u, exactly
};
/// The piece of joint `joint` from one point to the other, which must be later.
PathPiece path_piece(PathOrder order, const JointPathPoint& from, const JointPathPoint& to,
                     std::size_t joint);

/// A value of the polynomial on 0 <= u <= 1 outside of [lower, upper], or NaN if all are inside. By
/// subdivision in Bernstein form, whose coefficients enclose the polynomial.
double value_outside(const PathPiece& piece, double lower, double upper);

struct JointPath {
  PathOrder order = PathOrder::linear;
  bool has_feed_forward = false;
  std::vector<JointPathPoint> points;  ///< times ascending
};

}  // namespace takt
