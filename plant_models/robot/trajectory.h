#pragma once
// A predefined reference motion: knots with positions and velocities, joined by cubic Hermite polynomials. A
// trapezoidal speed profile with its knots at the corners is reproduced exactly.
#include <span>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"

namespace takt {

struct TrajectoryKnot {
  double t = 0.0;  ///< s
  JointArray q{}, qd{};
};

/// Limits of one joint in a point-to-point motion (rad/s and rad/s^2, or m/s and m/s^2).
struct MotionLimits {
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// Synchronous point-to-point motion from rest to rest: all joints share one path parameter, which runs with
/// a trapezoidal (or, on a short way, triangular) speed as fast as every joint's limits allow. A motion of
/// zero length has one knot. Throws std::invalid_argument for limits that are not positive or sizes that
/// differ.
std::vector<TrajectoryKnot> point_to_point(double t_start, std::span<const double> from,
                                           std::span<const double> to, std::span<const MotionLimits> limits);

/// Position, velocity, acceleration of n joints at t. At rest before the first and after the last knot; at a
/// knot, the acceleration is that of the next piece. Each pointer may be null.
void evaluate(std::span<const TrajectoryKnot> knots, int n, double t, double* q, double* qd, double* qdd);

}  // namespace takt
