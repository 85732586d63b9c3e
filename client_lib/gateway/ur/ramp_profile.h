#pragma once
// The time law of a part of a path: from a speed to a speed, along a path coordinate.
//
// Speed changes over ramps as the cubic 3 u^2 - 2 u^3, with a constant part between them: the law of MotionProfile, with ends
// that need not be at rest. Acceleration is zero at both ends; jerk is bounded. No clock: time begins at 0.
#include "client_lib/kinematics/motion_profile.h"

namespace takt::ur {

/// Peak of a ramp's acceleration over its mean: the derivative of 3 u^2 - 2 u^3 at u = 1/2.
inline constexpr double kRampPeak = 1.5;

class RampProfile {
 public:
  struct End {
    double s = 0.0;      ///< path coordinate
    double speed = 0.0;  ///< 1/s
  };

  /// The fastest law within the limits, `from.s` <= `to.s`. An end that cannot be reached with its speed is reached with more
  /// acceleration; reachable_speed() says where that begins.
  static RampProfile fastest(const End& from, const End& to, const ProfileLimits& limits);
  /// The law that takes `duration_s`, or the fastest one where that takes longer.
  static RampProfile lasting(double duration_s, const End& from, const End& to, const ProfileLimits& limits);
  /// The largest speed at the end of `way` that begins with `speed`.
  static double reachable_speed(double speed, double way, double acceleration);

  double duration_s() const { return up_s_ + cruise_s_ + down_s_; }
  double top_speed() const { return top_; }
  const End& from() const { return from_; }
  /// From here on it brakes.
  double braking_s() const { return up_s_ + cruise_s_; }
  MotionProfile::Sample at_time(double t_s) const;
  /// Another end, `t_s` after the beginning: what lies before stays. False, with nothing changed, where braking to that end
  /// would have begun already.
  bool end_at(const End& to, double t_s);

 private:
  RampProfile(const End& from, const End& to, double top, double acceleration);

  End from_, to_;
  double top_ = 0.0, acceleration_ = 0.0;
  double up_s_ = 0.0, cruise_s_ = 0.0, down_s_ = 0.0;
};

}  // namespace takt::ur
