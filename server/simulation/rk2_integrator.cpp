#include <array>
#include <stdexcept>

#include "server/simulation/integrator.h"

namespace takt {

Rk2Integrator::Rk2Integrator(int state_count) {
  const auto n = static_cast<std::size_t>(state_count);
  k1_.resize(n), k2_.resize(n), trial_.resize(n);
}

void Rk2Integrator::advance(OdeSystem& system, double t, double h, std::span<double> x) {
  system.derivatives_at_motion(t, x, k1_);
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) trial_[i] = x[i] + h * k1_[i];
  system.derivatives(t + h, trial_, k2_);
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) x[i] += 0.5 * h * (k1_[i] + k2_[i]);
}

namespace {
constexpr std::array<std::string_view, 1> kSolverNames{"rk2"};
}

std::span<const std::string_view> solver_names() {
  return kSolverNames;
}

std::unique_ptr<Integrator> make_integrator(std::string_view name, int state_count) {
  if (name == "rk2") return std::make_unique<Rk2Integrator>(state_count);
  throw std::invalid_argument("unknown solver '" + std::string(name) + "'; allowed: rk2");
}

}  // namespace takt
