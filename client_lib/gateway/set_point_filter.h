#pragma once
// Set-points of an outside controller, sampled for the steps of the cell. Pure: no clock, no transport.
//
// A controller sends set-points in its own cycle of wall time; the cell takes the newest one at the beginning of a step. Their
// age at that instant varies by a cycle, and a cell that is slow for a moment sees the controller's time pass faster than its own.
// Both make the positions jitter, and the velocities of the controller's time disagree with them. Drives and contact
// at levels of detail 2 and 3 follow each such jerk with small steps of the solver, which makes the cell slower still.
//
// The filter makes one set-point for each period of the cell's time. The controller's newest position is led on to the present by
// its own velocity; an alpha-beta filter with critical damping (both poles at exp(-bandwidth * dt)) follows it. Its velocity
// belongs to the cell's time. A motion at constant velocity is followed without lag, an acceleration a with the
// error a / bandwidth^2, and a position at rest is reached exactly.
// Source: Kalata, The tracking index (IEEE Transactions on Aerospace and Electronic Systems AES-20, 1984).
#include <optional>
#include <vector>

namespace takt::gateway {

struct SetPointFilterOptions {
  double bandwidth_rad_per_s = 60.0;
  double period_s = 0.002;  ///< of the set-points, in the cell's time
  /// Limits of the joints, in the order of the robot.
  std::vector<double> lower{}, upper{}, fastest{};
};

class SetPointFilter {
 public:
  struct SetPoint {
    std::vector<double> positions, velocities;
  };

  explicit SetPointFilter(SetPointFilterOptions options) : options_(std::move(options)) {}

  /// A set-point of the controller at `wall_s`; `velocities` may be empty. All set-points have as many joints as the limits.
  void take(std::vector<double> positions, std::vector<double> velocities, double wall_s);
  /// The controller has stopped the robot.
  void clear();
  /// At an instant of the cell: the set-point to send; nothing within a period, without a controller, and when an old
  /// set-point has been reached.
  std::optional<SetPoint> next(double cell_time_s, double wall_s);

 private:
  const SetPointFilterOptions options_;
  std::optional<SetPoint> newest_;
  double newest_s_ = 0.0;  ///< wall time
  bool fresh_ = false;     ///< not yet sampled
  bool runs_ = false;
  double at_s_ = 0.0;  ///< of the cell
  std::vector<double> q_, v_;
};

}  // namespace takt::gateway
