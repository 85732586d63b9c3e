#include "plant_models/robot/trajectory.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace takt {

std::vector<TrajectoryKnot> point_to_point(double t_start, std::span<const double> from,
                                           std::span<const double> to, std::span<const MotionLimits> limits) {
  const size_t n = from.size();
  if (to.size() != n || limits.size() != n || n > static_cast<size_t>(kMaxJoints))
    throw std::invalid_argument("point-to-point motion: start, end and limits of " + std::to_string(n) +
                                ", " + std::to_string(to.size()) + " and " + std::to_string(limits.size()) +
                                " joints");
  double slowest = 0.0, laziest = 0.0;  // 1/s and 1/s^2 reciprocal: how long joints take at their limits
  for (size_t i = 0; i < n; ++i) {
    if (!(limits[i].velocity > 0.0) || !(limits[i].acceleration > 0.0))
      throw std::invalid_argument("point-to-point motion: limits of joint " + std::to_string(i + 1) +
                                  " must be positive, found velocity " + std::to_string(limits[i].velocity) +
                                  " and acceleration " + std::to_string(limits[i].acceleration));
    slowest = std::max(slowest, std::abs(to[i] - from[i]) / limits[i].velocity);
    laziest = std::max(laziest, std::abs(to[i] - from[i]) / limits[i].acceleration);
  }
  const auto knot = [&](double t, double s, double sd) {
    TrajectoryKnot k;
    k.t = t;
    for (size_t i = 0; i < n; ++i) {
      k.q[i] = from[i] + s * (to[i] - from[i]);
      k.qd[i] = sd * (to[i] - from[i]);
    }
    return k;
  };
  if (slowest == 0.0) return {knot(t_start, 0.0, 0.0)};
  const double sd_max = 1.0 / slowest, sdd_max = 1.0 / laziest;
  std::vector<TrajectoryKnot> knots{knot(t_start, 0.0, 0.0)};
  double end;
  if (sd_max * sd_max / sdd_max < 1.0) {
    const double accelerated = sd_max / sdd_max, braking = 1.0 / sd_max;
    const double s = 0.5 * sd_max * accelerated;
    knots.push_back(knot(t_start + accelerated, s, sd_max));
    knots.push_back(knot(t_start + braking, 1.0 - s, sd_max));
    end = braking + accelerated;
  } else {
    const double half = std::sqrt(laziest);
    knots.push_back(knot(t_start + half, 0.5, sdd_max * half));
    end = 2.0 * half;
  }
  knots.push_back(knot(t_start + end, 1.0, 0.0));
  for (size_t i = 0; i < n; ++i) knots.back().q[i] = to[i];  // to the last bit
  return knots;
}

void evaluate(std::span<const TrajectoryKnot> knots, int n, double t, double* q, double* qd, double* qdd) {
  const auto after = std::upper_bound(knots.begin(), knots.end(), t,
                                      [](double time, const TrajectoryKnot& knot) { return time < knot.t; });
  if (after == knots.begin() || after == knots.end()) {
    const TrajectoryKnot& rest = after == knots.begin() ? knots.front() : knots.back();
    for (int i = 0; i < n; ++i) {
      if (q != nullptr) q[i] = rest.q[static_cast<size_t>(i)];
      if (qd != nullptr) qd[i] = 0.0;
      if (qdd != nullptr) qdd[i] = 0.0;
    }
    return;
  }
  const TrajectoryKnot &a = *(after - 1), &b = *after;
  const double T = b.t - a.t, s = t - a.t;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    // In powers of s from the left knot: exact for constant acceleration up to rounding.
    const double mean = (b.q[k] - a.q[k]) / T;
    const double c2 = (3.0 * mean - 2.0 * a.qd[k] - b.qd[k]) / T;
    const double c3 = (a.qd[k] + b.qd[k] - 2.0 * mean) / (T * T);
    if (q != nullptr) q[i] = a.q[k] + s * (a.qd[k] + s * (c2 + s * c3));
    if (qd != nullptr) qd[i] = a.qd[k] + s * (2.0 * c2 + 3.0 * s * c3);
    if (qdd != nullptr) qdd[i] = 2.0 * c2 + 6.0 * s * c3;
  }
}

}  // namespace takt
