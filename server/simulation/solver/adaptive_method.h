#pragma once
// The interface between takt's solvers with error control and the integrating library: the problem in the
// form that the library needs, and the library as AdaptiveIntegrator drives it. No type of the library
// appears here.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "server/simulation/model/solver.h"
#include "server/simulation/solver/error_scales.h"
#include "server/simulation/solver/system_jacobian.h"
#include "server/simulation/solver/velocity_system.h"

namespace takt {

/// x' = f(t, x) of an OdeSystem with error weights, indicators and Jacobian. Counts its evaluations.
class AdaptiveProblem {
 public:
  /// `matrix`: coupled is the linear system at velocity level, with the tangent of friction; all others are
  /// finite differences.
  AdaptiveProblem(const OdeSystem& system, double tolerance, SystemMatrix matrix);

  int state_count() const { return static_cast<int>(scales_.count()); }
  int indicator_count() const { return indicator_count_; }
  /// Reciprocals of the errors that are allowed at x.
  void error_weights(const double* x, double* weights) const;
  /// Norm of errors with their weights: the root mean square of the worst model. The number of other models in the cell
  /// must not loosen the tolerance.
  double error_norm(const double* errors, const double* weights) const;

  /// Sets the system of later evaluations.
  void use(OdeSystem& system) { system_ = &system; }
  /// Interval of permitted evaluation times: a method that stops at a corner of f, and restarts there, must
  /// not evaluate beyond it by a rounding error.
  void limit_times(double earliest, double latest) { earliest_ = earliest, latest_ = latest; }
  /// After a change of connections: finds the groups of coupled models again.
  void find_groups(double t, const double* x);
  /// False if a derivative is not finite; then a smaller step may help. Also false if a plant model threw:
  /// the exception is stored, because it must not pass through the library's C functions.
  bool derivatives(double t, const double* x, double* xdot);
  /// Likewise.
  bool indicators(double t, const double* x, double* g);
  bool evaluate_jacobian(double t, const double* x, const double* f0);
  /// At an accepted point within a communication step (OdeSystem::note_peaks).
  void note_peaks(double t, const double* x);
  /// Factorises a I - b J.
  bool factorise(double a, double b);
  void solve(double* b);

  /// Message of a plant model's exception, which no smaller step avoids; empty without one.
  const std::string& thrown() const { return thrown_; }

  /// The library's own words about its last error.
  void report(std::string_view text) { message_ = text; }
  const std::string& message() const { return message_; }
  void clear_message() { message_.clear(); }
  /// Call at the start of a communication step.
  void forget_errors() { message_.clear(), thrown_.clear(); }

  std::uint64_t evaluations = 0, jacobians = 0, factorisations = 0;

 private:
  OdeSystem* system_ = nullptr;
  double tolerance_;
  double earliest_, latest_;
  int indicator_count_;
  ErrorScales scales_;
  // Exactly one of the two exists.
  std::unique_ptr<SystemJacobian> jacobian_;
  std::unique_ptr<VelocitySystem> coupled_;
  std::vector<double> work_;
  SystemJacobian::Derivatives f_;
  std::string message_, thrown_;
};

/// A method of the library.
class AdaptiveMethod {
 public:
  virtual ~AdaptiveMethod() = default;
  enum class Outcome { stepped, crossing, failed };
  /// Counts since the last start().
  struct Counts {
    long steps = 0, rejected = 0, newton_iterations = 0, newton_failures = 0;
  };

  /// Restarts at (t, x) without memory of earlier steps. first_step_s = 0: the method chooses. False: failed.
  virtual bool start(double t, std::span<const double> x, double first_step_s) = 0;
  /// One step, not beyond t_stop. `t` becomes the time reached: of the step's end, or of the first
  /// indicator's crossing to negative.
  virtual Outcome step(double t_stop, double& t) = 0;
  /// At the time that step() or start() reached.
  virtual std::span<const double> state() const = 0;
  virtual double last_step_s() const = 0;
  virtual Counts counts() const = 0;
};

/// Names: cvode (BDF of CVODE), esdirk and esdirk4 (ARKODE, order 5 and 4), ida. All memory that steps need
/// is taken here. Throws std::runtime_error if the library refuses.
std::unique_ptr<AdaptiveMethod> make_adaptive_method(std::string_view name, AdaptiveProblem& problem);

}  // namespace takt
