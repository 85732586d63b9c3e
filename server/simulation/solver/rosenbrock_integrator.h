#pragma once
// The Rosenbrock W-method ROS34PW2 (rosenbrock_tableau.h) with error control, on the linear system at
// velocity level (velocity_system.h). For contact: large steps in smooth motion, small ones through an
// impact, no iteration, and an order that holds although the Jacobian is incomplete and contains friction's
// secant.
//
// A step has one Jacobian, four evaluations, four solutions; after a rejection only the matrix is factorised
// again. Steps end with the communication step, at corners of f that models announce, and at changes of
// modes, which cost some more attempts. The size of the next step is carried over from one communication step
// to the next.
//
// The cost of a communication step is bounded: below the smallest step a step is accepted with any error
// (SolverStatistics::forced_steps), which the secant Jacobian makes safe. Only derivatives that are not
// finite are a failure.
#include <vector>

#include "server/simulation/solver/integrator.h"
#include "server/simulation/solver/rosenbrock_step.h"

namespace takt {

class RosenbrockIntegrator final : public Integrator {
 public:
  static constexpr double kSmallestStep_s = 1e-6;

  RosenbrockIntegrator(const SolverParameters& parameters, const OdeSystem& system);
  void restart() override { restarted_ = true, step_ = 0.0; }
  void reset() override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;
  bool fixed_step() const override { return false; }
  bool one_step() const override { return true; }

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  using Outcome = RosenbrockStep::Outcome;
  void next_size(double h, bool cut_short);
  void note_step(double h);
  void switch_modes(OdeSystem& system, double t, std::span<double> x);
  /// Share of the trial step at which the first initial mode ends; above 1: all modes last.
  double mode_ends_at(OdeSystem& system, double t_end);
  bool find_step(OdeSystem& system, double t, double& h, bool& mode_ends, std::span<double> x);

  RosenbrockStep trial_;
  std::vector<double> indicators_, new_indicators_;
  double step_ = 0.0;        ///< proposal for the next step; 0: undefined
  double last_error_ = 1.0;  ///< of the last accepted step
  bool rejected_ = false;    ///< the present step was tried with a larger size
  bool restarted_ = true;
  double after_, before_;  ///< f has corners there; it is evaluated between
};

}  // namespace takt
