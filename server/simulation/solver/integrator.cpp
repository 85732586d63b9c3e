#include "server/simulation/solver/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "idl/common/text.h"
#include "server/simulation/solver/adaptive_integrator.h"
#include "server/simulation/solver/explicit_integrators.h"
#include "server/simulation/solver/implicit_integrator.h"
#include "server/simulation/solver/rosenbrock_integrator.h"

namespace takt {

namespace {

struct Solver {
  std::string_view name;
  std::unique_ptr<Integrator> (*make)(const SolverParameters&, const OdeSystem&);
  enum class Kind : std::uint8_t { is_explicit, fixed_step, error_control } kind;
  double default_tolerance = SolverParameters{}.tolerance;
};

template <typename Type>
std::unique_ptr<Integrator> make(const SolverParameters& parameters, const OdeSystem& system) {
  if constexpr (std::is_constructible_v<Type, const SolverParameters&, const OdeSystem&>)
    return std::make_unique<Type>(parameters, system);
  else
    return std::make_unique<Type>(system.state_count());
}

std::unique_ptr<Integrator> make_automatic(const SolverParameters& parameters, const OdeSystem& system) {
  return std::make_unique<RosenbrockIntegrator>(parameters, system,
                                                RosenbrockIntegrator::CalmSteps::two_stages);
}

// A communication step that is longer than the largest step by less than rounding is one step.
constexpr double kOnePiece = 1.0 + 1e-9;

constexpr std::array kSolvers{
    Solver{"rk2", make<Rk2Integrator>, Solver::Kind::is_explicit},
    Solver{"rk4", make<Rk4Integrator>, Solver::Kind::is_explicit},
    Solver{"implicit", make<ImplicitIntegrator>, Solver::Kind::fixed_step},
    Solver{"rosenbrock", make<RosenbrockIntegrator>, Solver::Kind::error_control, 1e-4},
    Solver{kAutomaticSolver, make_automatic, Solver::Kind::error_control, 1e-4},
    Solver{"cvode", make<AdaptiveIntegrator>, Solver::Kind::error_control},
    Solver{"esdirk", make<AdaptiveIntegrator>, Solver::Kind::error_control},
    Solver{"esdirk4", make<AdaptiveIntegrator>, Solver::Kind::error_control},
    Solver{"ida", make<AdaptiveIntegrator>, Solver::Kind::error_control}};

/// nullptr for an unknown name.
const Solver* find(std::string_view name) {
  const auto* const found = std::ranges::find(kSolvers, name, &Solver::name);
  return found == kSolvers.end() ? nullptr : found;
}

}  // namespace

bool Integrator::advance(OdeSystem& system, double t, double h, std::span<double> x) {
  failure_.clear();
  try {
    const double share = largest_step_s_ > 0.0 && fixed_step() ? h / largest_step_s_ : 1.0;
    if (share <= kOnePiece) return take_step(system, t, h, x);
    const double pieces = std::ceil(share / kOnePiece);
    for (double i = 0.0; i < pieces; ++i) {
      const double begin = t + h * (i / pieces);
      if (i > 0.0) system.update_motion(begin, x);
      if (!take_step(system, begin, h / pieces, x)) return false;
    }
    return true;
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
    if (!good) failure_ = "the state is not finite";
    return good;
  };
  if (!finite()) return false;
  if (system.indicator_count() == 0) return true;
  if (system.switch_modes(t_end, x)) ++statistics_.mode_switches;
  return finite();
}

std::span<const std::string_view> solver_names() {
  static constexpr auto kNames = [] {
    std::array<std::string_view, kSolvers.size()> names;
    std::ranges::transform(kSolvers, names.begin(), &Solver::name);
    return names;
  }();
  return kNames;
}

bool solver_has_error_control(std::string_view name) {
  const Solver* const solver = find(name);
  return solver != nullptr && solver->kind == Solver::Kind::error_control;
}

bool solver_is_explicit(std::string_view name) {
  const Solver* const solver = find(name);
  return solver != nullptr && solver->kind == Solver::Kind::is_explicit;
}

double solver_default_tolerance(std::string_view name) {
  const Solver* const solver = find(name);
  return solver == nullptr ? SolverParameters{}.tolerance : solver->default_tolerance;
}

std::unique_ptr<Integrator> make_integrator(const SolverParameters& parameters, const OdeSystem& system) {
  if (const Solver* const solver = find(parameters.name)) {
    std::unique_ptr<Integrator> integrator = solver->make(parameters, system);
    integrator->limit_step(parameters.step_s);
    return integrator;
  }
  throw std::invalid_argument("unknown solver '" + parameters.name +
                              "'; allowed: " + list_names(solver_names()));
}

}  // namespace takt
