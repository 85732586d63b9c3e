#include "server/simulation/solver/rk2_integrator.h"

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

}  // namespace takt
