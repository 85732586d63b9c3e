#pragma once
// One point of a trajectory: what Arm plans (arm.h) and Client::send_trajectory sends.
#include <vector>

namespace takt {

/// Positions (rad, m) of all joints in the order of the robot's description, and how they are passed.
/// `velocities` (rad/s, m/s) and `accelerations` (rad/s^2, m/s^2) may be empty; the velocities of the last point
/// must be 0. `efforts` (N m, N) may be empty too.
struct TrajectoryPoint {
  double time_s = 0.0;                  ///< from the start, ascending
  std::vector<double> positions;        ///< rad, m
  std::vector<double> velocities{};     ///< rad/s, m/s
  std::vector<double> accelerations{};  ///< rad/s^2, m/s^2
  std::vector<double> efforts{};        ///< N m, N
};

}  // namespace takt
