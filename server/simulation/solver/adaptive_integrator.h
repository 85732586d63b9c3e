#pragma once
// Solvers with error control: they choose their own steps within a communication step and stop at its end, at
// times that models announce (next_time_event), and at zero crossings of indicators. Changes of connections
// and modes restart them, set-points do not. All Parts take part, also those at rest: the methods' memory of
// earlier steps is not in the state, so an unchanged state does not prove that a Part stays at rest.
//
// After a failure (a derivative that is not finite, no convergence) the solver starts again from the last
// accepted point with ever smaller steps; after that advance() fails with a reason.
#include <memory>
#include <vector>

#include "server/simulation/solver/adaptive_method.h"
#include "server/simulation/solver/integrator.h"

namespace takt {

class AdaptiveIntegrator final : public Integrator {
 public:
  AdaptiveIntegrator(const SolverParameters& parameters, const OdeSystem& system);
  void restart() override { restart_pending_ = true; }
  bool fixed_step() const override { return false; }
  bool hides_history() const override { return true; }

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  bool start(double t, std::span<const double> x, double first_step_s);
  bool recover(double t, double stop, std::span<double> x);
  bool take_state(double t_before, double t, std::span<double> x);
  bool switch_modes(OdeSystem& system, double t, std::span<double> x, bool& changed);
  bool note_event(double t);
  bool fail(double t, const std::string& reason);
  bool check_modes(double t, std::span<const double> x, bool& wrong);
  void count();

  AdaptiveProblem problem_;
  std::unique_ptr<AdaptiveMethod> method_;  ///< null if there are no states
  AdaptiveMethod::Counts counted_;
  std::vector<double> indicators_;
  bool restart_pending_ = true;
  double t_ = 0.0;  ///< where the method stands
  double after_;    ///< the last known corner of f
  // Bounds, counted within one communication step.
  int steps_ = 0, attempts_ = 0, attempts_here_ = 0, events_ = 0, events_here_ = 0;
  double last_event_ = 0.0;
};

}  // namespace takt
