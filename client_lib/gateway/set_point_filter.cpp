#include "client_lib/gateway/set_point_filter.h"

#include <algorithm>
#include <cmath>

namespace takt::gateway {
namespace {

constexpr double kRounding_s = 1e-9;
/// After a longer pause of the cell's time the filter begins at the controller's set-point.
constexpr double kLongestGap_s = 0.5;
/// An older set-point is not led on: its controller is silent.
constexpr double kSilent_s = 0.1;
/// Nearer than this the set-point is reached.
constexpr double kReached = 1e-7, kAtRest = 1e-5;

}  // namespace

void SetPointFilter::take(std::vector<double> positions, std::vector<double> velocities, double wall_s) {
  velocities.resize(positions.size(), 0.0);
  newest_ = SetPoint{std::move(positions), std::move(velocities)};
  newest_s_ = wall_s;
  fresh_ = true;
}

void SetPointFilter::clear() {
  newest_.reset();
  runs_ = fresh_ = false;
}

std::optional<SetPointFilter::SetPoint> SetPointFilter::next(double cell_time_s, double wall_s) {
  if (!newest_) return std::nullopt;
  const std::size_t n = newest_->positions.size();
  const double dt = cell_time_s - at_s_;
  if (runs_ && dt >= 0.0 && dt < options_.period_s - kRounding_s) return std::nullopt;
  const bool silent = wall_s - newest_s_ > kSilent_s;
  const double age_s = silent ? 0.0 : std::clamp(wall_s - newest_s_, 0.0, options_.period_s);
  std::vector<double> wanted(n);
  for (std::size_t i = 0; i < n; ++i) {
    wanted[i] = newest_->positions[i];
    if (newest_->velocities[i] != 0.0)
      wanted[i] = std::clamp(wanted[i] + age_s * newest_->velocities[i],
                             std::min(options_.lower[i], wanted[i]), std::max(options_.upper[i], wanted[i]));
  }
  const bool begins = !runs_ || dt < 0.0 || dt > kLongestGap_s;
  if (begins) {
    q_ = wanted;
    v_ = newest_->velocities;
  } else {
    const double pole = std::exp(-options_.bandwidth_rad_per_s * dt);
    const double alpha = 1.0 - pole * pole, beta = (1.0 - pole) * (1.0 - pole);
    const bool rests = q_ == wanted && std::all_of(v_.begin(), v_.end(), [](double v) { return v == 0.0; });
    bool reached = true;
    for (std::size_t i = 0; i < n; ++i) {
      const double predicted = q_[i] + dt * v_[i], residual = wanted[i] - predicted;
      reached = reached && std::abs(wanted[i] - q_[i]) < kReached && std::abs(v_[i]) < kAtRest &&
                (silent || newest_->velocities[i] == 0.0);
      const double q = predicted + alpha * residual;
      q_[i] = std::clamp(q, std::min(options_.lower[i], wanted[i]), std::max(options_.upper[i], wanted[i]));
      v_[i] = q_[i] != q
                  ? 0.0
                  : std::clamp(v_[i] + beta / dt * residual, -options_.fastest[i], options_.fastest[i]);
    }
    if (reached) {
      q_ = wanted;
      std::fill(v_.begin(), v_.end(), 0.0);
    }
    if (rests && !fresh_) {
      at_s_ = cell_time_s;
      return std::nullopt;
    }
  }
  runs_ = true;
  fresh_ = false;
  at_s_ = cell_time_s;
  return SetPoint{q_, v_};
}

}  // namespace takt::gateway
