#include "client_lib/gateway/ur/ramp_profile.h"

#include <algorithm>
#include <cmath>

namespace takt::ur {
namespace {

double ramp_s(double from, double to, double acceleration) {
  return kRampPeak * std::abs(to - from) / acceleration;
}

/// `t` after the beginning of a ramp that lasts `duration`; s is the way since then.
MotionProfile::Sample on_ramp(double from, double to, double duration, double t) {
  const double u = t / duration, change = to - from;
  return {from * t + change * duration * u * u * u * (1.0 - 0.5 * u), from + change * u * u * (3.0 - 2.0 * u),
          change / duration * 6.0 * u * (1.0 - u)};
}

/// The top speed at which both ramps take the whole way.
double top_without_cruise(double way, double from, double to, double acceleration) {
  return std::sqrt(0.5 * (2.0 * way * acceleration / kRampPeak + from * from + to * to));
}

}  // namespace

RampProfile::RampProfile(const End& from, const End& to, double top, double acceleration)
    : from_(from), to_(to), top_(top), acceleration_(acceleration) {
  up_s_ = ramp_s(from.speed, top, acceleration);
  down_s_ = ramp_s(top, to.speed, acceleration);
  const double ramps = 0.5 * (from.speed + top) * up_s_ + 0.5 * (top + to.speed) * down_s_;
  cruise_s_ = top > 0.0 ? std::max(0.0, to.s - from.s - ramps) / top : 0.0;
}

RampProfile RampProfile::fastest(const End& from, const End& to, const ProfileLimits& limits) {
  const double top =
      std::min(limits.speed, top_without_cruise(to.s - from.s, from.speed, to.speed, limits.acceleration));
  return {from, to, std::max({top, from.speed, to.speed}), limits.acceleration};
}

RampProfile RampProfile::lasting(double duration_s, const End& from, const End& to,
                                 const ProfileLimits& limits) {
  const RampProfile shortest = fastest(from, to, limits);
  double slow = std::max(from.speed, to.speed), fast = shortest.top_;
  if (shortest.duration_s() >= duration_s || slow >= fast) return shortest;
  // A higher top speed takes less time.
  for (int i = 0; i < 60; ++i) {
    const double top = 0.5 * (slow + fast);
    (RampProfile(from, to, top, limits.acceleration).duration_s() > duration_s ? slow : fast) = top;
  }
  return {from, to, fast, limits.acceleration};
}

double RampProfile::reachable_speed(double speed, double way, double acceleration) {
  return std::sqrt(speed * speed + 2.0 * std::max(0.0, way) * acceleration / kRampPeak);
}

MotionProfile::Sample RampProfile::at_time(double t_s) const {
  if (t_s <= 0.0) return {from_.s, from_.speed, 0.0};
  if (t_s >= duration_s()) return {to_.s, to_.speed, 0.0};
  if (t_s < up_s_) {
    const MotionProfile::Sample ramp = on_ramp(from_.speed, top_, up_s_, t_s);
    return {from_.s + ramp.s, ramp.speed, ramp.acceleration};
  }
  if (t_s < braking_s())
    return {from_.s + 0.5 * (from_.speed + top_) * up_s_ + top_ * (t_s - up_s_), top_, 0.0};
  // Counted from the end, so that it is met.
  const MotionProfile::Sample ramp = on_ramp(to_.speed, top_, down_s_, duration_s() - t_s);
  return {to_.s - ramp.s, ramp.speed, -ramp.acceleration};
}

bool RampProfile::end_at(const End& to, double t_s) {
  if (t_s > braking_s() || to.speed > top_) return false;
  const double down_s = ramp_s(top_, to.speed, acceleration_);
  const double cruise =
      to.s - from_.s - 0.5 * (from_.speed + top_) * up_s_ - 0.5 * (top_ + to.speed) * down_s;
  if (cruise < 0.0 || up_s_ + cruise / top_ < t_s) return false;
  to_ = to;
  cruise_s_ = cruise / top_;
  down_s_ = down_s;
  return true;
}

}  // namespace takt::ur
