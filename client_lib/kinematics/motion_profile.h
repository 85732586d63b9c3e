#pragma once
// The time law of a motion: how far along its path a robot is, from rest to rest.
//
// The path coordinate s runs from 0 to 1 in a whole number of controller periods. Speed rises over a ramp as
// the cubic 3 u^2 - 2 u^3, stays constant, and falls the same way; short motions have no constant part.
// Position is twice continuously differentiable everywhere (acceleration is zero at the start, at the end and
// on the constant part) and the jerk is bounded.
#include <optional>

namespace takt {

/// Largest speed and acceleration of the path coordinate (1/s and 1/s^2); infinite where nothing limits.
struct ProfileLimits {
  double speed = 0.0;         ///< 1/s
  double acceleration = 0.0;  ///< 1/s^2
};

/// A path coordinate over time, from rest to rest.
class MotionProfile {
 public:
  /// The path coordinate and its derivatives at an instant.
  struct Sample {
    double s = 0.0;             ///< path coordinate, exactly 1 at the end
    double speed = 0.0;         ///< ds/dt, 1/s
    double acceleration = 0.0;  ///< d2s/dt2, 1/s^2
  };

  /// The fastest profile within the limits, slowed down to a whole number of periods (at least one).
  static MotionProfile fastest(const ProfileLimits& limits, double period_s);

  /// The fastest profile, slowed down evenly to `duration_s` (rounded up to whole periods). Empty if the limits do not
  /// allow so short a time.
  static std::optional<MotionProfile> lasting(double duration_s, const ProfileLimits& limits,
                                              double period_s);

  /// From the start to the end, s.
  double duration_s() const { return duration_s_; }
  /// Number of the last period; the motion begins at period 0.
  long periods() const { return periods_; }
  /// At the end of period k, 0 <= k; from periods() on the motion is at its end.
  Sample at_period(long k) const;
  /// At time t since the beginning.
  Sample at_time(double t_s) const;

 private:
  MotionProfile(double shortest_s, double ramp_fraction, double duration_s, double period_s);

  double duration_s_ = 0.0;
  double ramp_s_ = 0.0;  ///< duration of each of the two ramps
  double top_speed_ = 0.0;
  double period_s_ = 0.0;
  long periods_ = 0;
};

}  // namespace takt
