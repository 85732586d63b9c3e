#pragma once
// Solvers by name. A solver advances the state over one communication step; set-points and connections are
// constant during the step. Modes inside plant models (true friction) are switched at accepted points only:
// at their zero crossings if the solver can locate them, else at the end of each of its steps.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/simulation/model/solver.h"
#include "server/simulation/solver/ode_system.h"

namespace takt {

class StateReader;
class StateWriter;

class Integrator {
 public:
  virtual ~Integrator() = default;
  /// x(t) -> x(t + h) in place. The caller has just called system.update_motion(t, x). False if the solver
  /// failed in spite of its recoveries, or a plant model threw; failure() then has the reason, and x is
  /// invalid. True: x is finite. Throws no exception derived from std::exception.
  bool advance(OdeSystem& system, double t, double h, std::span<double> x);
  /// A method with a fixed step divides longer communication steps into equal ones; 0: it does not.
  void limit_step(double largest_step_s) { largest_step_s_ = largest_step_s; }
  /// Call after a discontinuous change of the right-hand side or the state: multi-step methods discard their
  /// memory.
  virtual void restart() {}
  /// After a reset of the cell.
  virtual void reset() { restart(), statistics_ = {}, failure_.clear(); }

  /// Saves the memory of earlier steps; methods with a fixed step have none.
  virtual void save(StateWriter& out) const { static_cast<void>(out); }
  virtual void load(StateReader& in) { static_cast<void>(in); }
  /// True if that memory cannot be saved because it is inside a library. Saving and loading then both replace
  /// the integrator, so that both runs continue with the same bits.
  virtual bool hides_history() const { return false; }
  /// Discards caches of earlier steps. Called when the state is saved, because a restored run has no caches.
  virtual void forget() {}
  void set_statistics(const SolverStatistics& statistics) { statistics_ = statistics; }

  /// True if a step without surface contact is one evaluation of a fixed formula of (t, x, h) alone. Only
  /// then may the next step skip a Part whose state did not change.
  virtual bool fixed_step() const { return true; }
  /// True if only x and a step size pass from one step to the next: Parts may then be left out and added
  /// again at any communication step (OdeSystem::set_awake).
  virtual bool one_step() const { return fixed_step(); }

  const SolverStatistics& statistics() const { return statistics_; }
  const std::string& failure() const { return failure_; }

 protected:
  /// advance() without its guard against exceptions of plant models. False: failure_ has the reason.
  virtual bool take_step(OdeSystem& system, double t, double h, std::span<double> x) = 0;
  /// Common end of a step of all solvers with a fixed step, at t + h. False: x is not finite.
  bool finish_fixed_step(OdeSystem& system, double t, double h, std::span<double> x,
                         std::uint64_t evaluations);
  /// The same without counting: modes, and the check that x is finite.
  bool finish(OdeSystem& system, double t_end, std::span<double> x);

  SolverStatistics statistics_;
  std::string failure_;

 private:
  double largest_step_s_ = 0.0;
};

/// Meaning of SystemMatrix::automatic for this system.
inline bool is_coupled(SystemMatrix matrix, const OdeSystem& system) {
  return matrix == SystemMatrix::coupled || (matrix == SystemMatrix::automatic && system.has_stiff_pairs());
}

/// Throws std::invalid_argument for an unknown name.
std::unique_ptr<Integrator> make_integrator(const SolverParameters& parameters, const OdeSystem& system);

}  // namespace takt
