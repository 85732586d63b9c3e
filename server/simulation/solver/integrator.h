#pragma once
// Solvers by name. A solver advances the state over one communication step during which all discrete facts
// from outside (set-points, connections) stay as they are. Modes inside plant models (true friction) are
// switched at accepted points only: at their zero crossings where the solver can locate them, else at the end
// of each of its steps.
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
  /// could not get there although it tried to recover, or a plant model threw; failure() then says why, and x
  /// is not to be used. True: x is finite. Throws nothing that derives from std::exception.
  bool advance(OdeSystem& system, double t, double h, std::span<double> x);
  /// The right-hand side or the state changed discontinuously since the last step: what multi-step methods
  /// remember is void.
  virtual void restart() {}
  /// After a reset of the cell.
  virtual void reset() { restart(), statistics_ = {}, failure_.clear(); }

  /// What earlier steps leave for later ones, which is nothing for methods with a fixed step.
  virtual void save(StateWriter& out) const { static_cast<void>(out); }
  virtual void load(StateReader& in) { static_cast<void>(in); }
  /// What earlier steps leave cannot be saved, as it is inside a library. Whoever saves goes on with a new
  /// integrator, as whoever loads does.
  virtual bool hides_history() const { return false; }
  /// What earlier steps leave only to save work is forgotten: called where the state is saved, as whoever
  /// loads it begins without.
  virtual void forget() {}
  void set_statistics(const SolverStatistics& statistics) { statistics_ = statistics; }

  /// While nothing acts by surface contact, the step is one evaluation of a fixed formula of (t, x, h) alone.
  /// Only then may what a step left unchanged be left out of the next one.
  virtual bool fixed_step() const { return true; }
  /// Nothing but x and a step size is remembered from one step to the next: Parts may be left out and come
  /// back at any communication step (OdeSystem::set_awake).
  virtual bool one_step() const { return fixed_step(); }

  const SolverStatistics& statistics() const { return statistics_; }
  const std::string& failure() const { return failure_; }

 protected:
  /// advance() without its guard against what plant models throw. False: failure_ says why.
  virtual bool take_step(OdeSystem& system, double t, double h, std::span<double> x) = 0;
  /// What every solver with a fixed step does when it has arrived at t + h. False: x is not finite.
  bool finish_fixed_step(OdeSystem& system, double t, double h, std::span<double> x,
                         std::uint64_t evaluations);
  /// Its part that counts nothing: modes, and whether x is finite.
  bool finish(OdeSystem& system, double t_end, std::span<double> x);

  SolverStatistics statistics_;
  std::string failure_;
};

/// What SystemMatrix::automatic means for this system.
inline bool is_coupled(SystemMatrix matrix, const OdeSystem& system) {
  return matrix == SystemMatrix::coupled || (matrix == SystemMatrix::automatic && system.has_stiff_pairs());
}

/// Throws std::invalid_argument for an unknown name.
std::unique_ptr<Integrator> make_integrator(const SolverParameters& parameters, const OdeSystem& system);

}  // namespace takt
