#include "server/simulation/solver/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "idl/common/text.h"
#include "server/simulation/solver/adaptive_integrator.h"
#include "server/simulation/solver/implicit_integrator.h"
#include "server/simulation/solver/rk2_integrator.h"
#include "server/simulation/solver/rk4_integrator.h"
#include "server/simulation/solver/rosenbrock_integrator.h"

namespace takt {

namespace {
constexpr std::array<std::string_view, 8> kSolverNames{"rk2",   "rk4",    "implicit", "rosenbrock",
                                                       "cvode", "esdirk", "esdirk4",  "ida"};
constexpr std::array<std::string_view, 5> kErrorControlled{"rosenbrock", "cvode", "esdirk", "esdirk4", "ida"};
}  // namespace

bool Integrator::advance(OdeSystem& system, double t, double h, std::span<double> x) {
  failure_.clear();
  try {
    return take_step(system, t, h, x);
  } catch (const std::exception& error) {
    restart();
    failure_ = std::string("a plant model could not be evaluated: ") + error.what();
    return false;
  }
}

bool Integrator::finish_fixed_step(OdeSystem& system, double t, double h, std::span<double> x,
                                   std::uint64_t evaluations) {
  ++statistics_.steps;
  statistics_.evaluations += evaluations;
  statistics_.smallest_step_s = statistics_.largest_step_s = h;
  return finish(system, t + h, x);
}

bool Integrator::finish(OdeSystem& system, double t_end, std::span<double> x) {
  // Only finite states are passed to the modes, which may set states themselves.
  const auto finite = [&] {
    bool good = true;
    for (const OdeSystem::Range& range : system.active_states())
      for (std::size_t i = range.begin; i < range.end; ++i) good = good && std::isfinite(x[i]);
    if (!good) failure_ = "the state is not finite any more";
    return good;
  };
  if (!finite()) return false;
  if (system.indicator_count() == 0) return true;
  if (system.switch_modes(t_end, x)) ++statistics_.mode_switches;
  return finite();
}

std::span<const std::string_view> solver_names() {
  return kSolverNames;
}

bool solver_has_error_control(std::string_view name) {
  return std::find(kErrorControlled.begin(), kErrorControlled.end(), name) != kErrorControlled.end();
}

bool solver_is_explicit(std::string_view name) {
  return name == "rk2" || name == "rk4";
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
  throw std::invalid_argument("unknown solver '" + parameters.name +
                              "'; allowed: " + list_names(kSolverNames));
}

}  // namespace takt
