#include "client_lib/kinematics/motion_profile.h"

#include <algorithm>
#include <cmath>

namespace takt {

namespace {
/// Peak of the ramp's acceleration over its mean: the derivative of 3 u^2 - 2 u^3 at u = 1/2.
constexpr double kRampPeak = 1.5;

struct Shape {
  double duration_s = 0.0;
  double ramp_fraction = 0.5;  ///< of the duration, each ramp
};

Shape fastest_shape(const ProfileLimits& limits) {
  // A ramp to speed v takes kRampPeak v / a and covers half of v times that, so both together cover v^2
  // kRampPeak / a.
  const double speed_without_cruise = std::sqrt(limits.acceleration / kRampPeak);
  const double speed = std::min(limits.speed, speed_without_cruise);
  if (std::isinf(speed)) return {};
  const double ramp = std::isinf(limits.acceleration) ? 0.0 : kRampPeak * speed / limits.acceleration;
  const double duration = 1.0 / speed + ramp;
  return {duration, std::min(0.5, ramp / duration)};
}

/// Whole periods, without being pushed to the next one by rounding.
long whole_periods(double duration_s, double period_s) {
  return std::max(1L, static_cast<long>(std::ceil(duration_s / period_s - 1e-9)));
}
}  // namespace

MotionProfile::MotionProfile(double shortest_s, double ramp_fraction, double duration_s, double period_s)
    : period_s_(period_s), periods_(whole_periods(std::max(shortest_s, duration_s), period_s)) {
  duration_s_ = static_cast<double>(periods_) * period_s;
  ramp_s_ = ramp_fraction * duration_s_;
  top_speed_ = 1.0 / (duration_s_ - ramp_s_);
}

MotionProfile MotionProfile::fastest(const ProfileLimits& limits, double period_s) {
  const Shape shape = fastest_shape(limits);
  return {shape.duration_s, shape.ramp_fraction, shape.duration_s, period_s};
}

std::optional<MotionProfile> MotionProfile::lasting(double duration_s, const ProfileLimits& limits,
                                                    double period_s) {
  const Shape shape = fastest_shape(limits);
  if (duration_s < shape.duration_s - 1e-9) return std::nullopt;
  return MotionProfile(shape.duration_s, shape.ramp_fraction, duration_s, period_s);
}

MotionProfile::Sample MotionProfile::at_period(long k) const {
  if (k >= periods_) return {1.0, 0.0, 0.0};
  return at_time(static_cast<double>(k) * period_s_);
}

MotionProfile::Sample MotionProfile::at_time(double t_s) const {
  if (t_s <= 0.0) return {0.0, 0.0, 0.0};
  if (t_s >= duration_s_) return {1.0, 0.0, 0.0};
  const double to_go = duration_s_ - t_s;
  const double in_ramp = std::min(t_s, to_go);
  if (in_ramp >= ramp_s_) return {top_speed_ * (t_s - 0.5 * ramp_s_), top_speed_, 0.0};
  const double u = in_ramp / ramp_s_;
  const double s = top_speed_ * ramp_s_ * u * u * u * (1.0 - 0.5 * u);
  const double acceleration = top_speed_ / ramp_s_ * 6.0 * u * (1.0 - u);
  const Sample rising{s, top_speed_ * u * u * (3.0 - 2.0 * u), acceleration};
  if (t_s <= to_go) return rising;
  return {1.0 - rising.s, rising.speed, -rising.acceleration};
}

}  // namespace takt
