#include "server/simulation/integrator.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "server/simulation/adaptive_integrator.h"
#include "server/simulation/implicit_integrator.h"
#include "server/simulation/rk2_integrator.h"
#include "server/simulation/rk4_integrator.h"
#include "server/simulation/rosenbrock_integrator.h"

namespace takt {

namespace {
constexpr std::array<std::string_view, 8> kSolverNames{"rk2",   "rk4",    "implicit", "rosenbrock",
                                                       "cvode", "esdirk", "esdirk4",  "ida"};
constexpr std::array<std::string_view, 5> kErrorControlled{"rosenbrock", "cvode", "esdirk", "esdirk4", "ida"};
}  // namespace

void Integrator::finish_fixed_step(OdeSystem& system, double t, double h, std::span<double> x,
                                   std::uint64_t evaluations) {
  ++statistics_.steps;
  statistics_.evaluations += evaluations;
  statistics_.smallest_step_s = statistics_.largest_step_s = h;
  if (system.switch_modes(t + h, x)) ++statistics_.mode_switches;
}

std::span<const std::string_view> solver_names() {
  return kSolverNames;
}

bool solver_has_error_control(std::string_view name) {
  return std::find(kErrorControlled.begin(), kErrorControlled.end(), name) != kErrorControlled.end();
}

double solver_default_tolerance(std::string_view name) {
  return name == "rosenbrock" ? 1e-4 : SolverParameters{}.tolerance;
}

std::unique_ptr<Integrator> make_integrator(const SolverParameters& parameters, const OdeSystem& system) {
  if (parameters.name == "rk2") return std::make_unique<Rk2Integrator>(system.state_count());
  if (parameters.name == "rk4") return std::make_unique<Rk4Integrator>(system.state_count());
  if (parameters.name == "implicit") return std::make_unique<ImplicitIntegrator>(parameters, system);
  if (parameters.name == "rosenbrock") return std::make_unique<RosenbrockIntegrator>(parameters, system);
  if (solver_has_error_control(parameters.name))
    return std::make_unique<AdaptiveIntegrator>(parameters, system);
  std::string allowed;
  for (const std::string_view name : kSolverNames)
    allowed += (allowed.empty() ? "" : ", ") + std::string(name);
  throw std::invalid_argument("unknown solver '" + parameters.name + "'; allowed: " + allowed);
}

}  // namespace takt
