#pragma once
// Choice of the solver, its accuracy, and its statistics: plain data.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace takt {

/// Composition of the linear systems of implicit solvers. `rosenbrock` and `automatic` always have the coupled
/// one.
enum class SystemMatrix : std::uint8_t {
  automatic,  ///< coupled where pairs are stiff (surface contact), else separate
  separate,   ///< implicit: stiff terms inside each model; others: finite differences, group by group
  coupled,    ///< models with the forces between them, at velocity level (velocity_system.h)
};

struct SolverParameters {
  std::string name = "rk2";
  double tolerance = 1e-6;  ///< relative; absolute tolerances: times the states' scales
  double step_s = 0.0;      ///< largest step of methods without error control; 0: the communication step
  SystemMatrix matrix = SystemMatrix::automatic;
};

struct SolverStatistics {
  std::uint64_t steps = 0;           ///< accepted by the solver
  std::uint64_t rejected_steps = 0;  ///< error test failures
  std::uint64_t evaluations = 0;     ///< of the right-hand side, including those for Jacobians
  std::uint64_t jacobians = 0;
  std::uint64_t factorisations = 0;
  std::uint64_t newton_iterations = 0, newton_failures = 0;
  /// Accepted with a larger error: at the smallest step, or after the last attempt.
  std::uint64_t forced_steps = 0;
  std::uint64_t restarts = 0;
  std::uint64_t mode_switches = 0;  ///< changes of plant models' modes
  double smallest_step_s = 0.0, largest_step_s = 0.0;
};

/// The solver of `solver.contact` and `solver.dynamics` unless another one is named.
inline constexpr std::string_view kAutomaticSolver = "automatic";

/// Names make_integrator() accepts, for error texts.
std::span<const std::string_view> solver_names();
/// True for the solvers that choose their steps by a tolerance.
bool solver_has_error_control(std::string_view name);
/// True for solvers with fixed step and without linear systems. They cannot follow surface contact, whose
/// friction has rates of 10^5 1/s and more that depend on the forces.
bool solver_is_explicit(std::string_view name);
/// Default tolerance of a solver.
double solver_default_tolerance(std::string_view name);

}  // namespace takt
