#include "server/simulation/solver/explicit_integrators.h"

namespace takt {

Rk2Integrator::Rk2Integrator(int state_count) {
  const auto n = static_cast<std::size_t>(state_count);
  k1_.resize(n), k2_.resize(n), trial_.resize(n);
}

bool Rk2Integrator::take_step(OdeSystem& system, double t, double h, std::span<double> x) {
  system.derivatives_at_motion(t, x, k1_);
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) trial_[i] = x[i] + h * k1_[i];
  system.derivatives(t + h, trial_, k2_);
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) x[i] += 0.5 * h * (k1_[i] + k2_[i]);
  return finish_fixed_step(system, t, h, x, 2);
}

Rk4Integrator::Rk4Integrator(int state_count) {
  const auto n = static_cast<std::size_t>(state_count);
  for (auto& k : k_) k.resize(n);
  trial_.resize(n);
}

bool Rk4Integrator::take_step(OdeSystem& system, double t, double h, std::span<double> x) {
  const auto go_along = [&](const std::vector<double>& k, double step) {
    for (const OdeSystem::Range& range : system.active_states())
      for (std::size_t i = range.begin; i < range.end; ++i) trial_[i] = x[i] + step * k[i];
  };
  system.derivatives_at_motion(t, x, k_[0]);
  go_along(k_[0], 0.5 * h);
  system.derivatives(t + 0.5 * h, trial_, k_[1]);
  go_along(k_[1], 0.5 * h);
  system.derivatives(t + 0.5 * h, trial_, k_[2]);
  go_along(k_[2], h);
  system.derivatives(t + h, trial_, k_[3]);
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i)
      x[i] += h / 6.0 * (k_[0][i] + 2.0 * (k_[1][i] + k_[2][i]) + k_[3][i]);
  return finish_fixed_step(system, t, h, x, 4);
}

}  // namespace takt
