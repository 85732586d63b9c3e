#pragma once
// Trial steps of the linearly implicit methods on the linear system at velocity level (velocity_system.h). One linearisation at the beginning of a step serves all its trials; a trial of
// another size only factorises again. Both methods keep their order with an A of an earlier step.
//   ROS34PW2 (rosenbrock_tableau.h): four stages, order 3, error estimate of order 2.
//   ROS2 (implicit_integrator.h): two stages, order 2; its error estimate is a tenth of the difference from
//   x + h k1, which is of order 1. Where trials of equal size follow one another, the change of that difference
//   is an estimate of order 2. Its defect, f at the end less the rate at which the step ends, filtered by the matrix
//   (Enright, Analysis of error control strategies for continuous Runge-Kutta methods, SIAM J. Numer. Anal. 26, 1989).
//   The linearly implicit method of Euler, (I - h A) k = f + h f_t, x + h k: order 1. It dissipates the
//   energy of unresolved motion.
#include <limits>
#include <span>
#include <vector>

#include "server/simulation/model/solver.h"
#include "server/simulation/solver/error_scales.h"
#include "server/simulation/solver/velocity_system.h"

namespace takt {

class RosenbrockStep {
 public:
  enum class Outcome { good, too_large, not_finite };

  /// Counts evaluations, Jacobians and factorisations in `statistics`, which must outlive it.
  RosenbrockStep(const OdeSystem& system, double tolerance, SolverStatistics& statistics,
                 Linearisation of_friction);

  /// f is evaluated between these times, where it has no corner.
  void limit_times(double after, double before) { after_ = after, before_ = before; }
  double clamped(double t) const;

  /// f and its time derivative at the start (t, x) of the trials, the first of which has the size h. False: f is
  /// not finite.
  bool begin(OdeSystem& system, double t, double h, std::span<const double> x);
  /// A at (t, x), the point of the last begin().
  void linearise(OdeSystem& system, double t, std::span<const double> x);
  /// Of the next linearisations.
  void set_linearisation(Linearisation of_friction) { of_friction_ = of_friction; }
  /// begin() and linearise(), which evaluate surface contacts once.
  bool begin_linearised(OdeSystem& system, double t, double h, std::span<const double> x);
  /// Trials from the point of the last begin(); the result is new_x().
  Outcome four_stages(OdeSystem& system, double t, double h, std::span<const double> x);
  Outcome two_stages(OdeSystem& system, double t, double h, std::span<const double> x);
  /// With the factors of the last trial, by the same method with the same h.
  Outcome four_stages_again(OdeSystem& system, double t, double h, std::span<const double> x);
  Outcome two_stages_again(OdeSystem& system, double t, double h, std::span<const double> x);
  Outcome euler(OdeSystem& system, double h, std::span<const double> x);

  /// Derivatives at the start of the trials, and at the last stage of the last trial of four stages, which is at its end.
  const std::vector<double>& start_rates() const { return f0_; }
  const std::vector<double>& end_rates() const { return f1_; }
  const std::vector<double>& new_x() const { return new_x_; }
  /// Where the last trial of two stages took its second derivatives.
  const std::vector<double>& stage_x() const { return work_; }
  /// Error of the last trial of two or four stages, in units of the tolerance.
  double error() const { return error_; }
  /// The same of one segment.
  double error_of(const OdeSystem& system, std::size_t segment, std::span<const double> x) const {
    return error_of(system, segment, x, errors_);
  }
  /// Of the last trial of two stages: how its difference from Euler's method differs from that of the trial that was
  /// remembered, one step of the same size earlier: an error of order 2, so that steady acceleration has none.
  void find_change(const OdeSystem& system);
  /// After find_change().
  double change_of(const OdeSystem& system, std::size_t segment, std::span<const double> x) const {
    return error_of(system, segment, x, u_[2]);
  }
  /// Of the last trial of two stages: how far stiff states are from where the forces at its end drive them. The other two
  /// estimates do not see an error that each trial makes alike, such as that of an A that lacks terms.
  void find_defect(OdeSystem& system, double t, double h);
  /// After find_defect().
  double defect_of(const OdeSystem& system, std::size_t segment, std::span<const double> x) const {
    return error_of(system, segment, x, u_[3]);
  }
  /// How far the cubic through a trial of four stages is from the straight line between its ends, in units of the tolerance.
  double bend_of(const OdeSystem& system, std::size_t segment, double h, std::span<const double> x);
  std::span<const int> units_of_bodies() const { return linear_.units_of_bodies(); }
  /// Remembers the last trial of two stages.
  void remember();

 private:
  double error_of(const OdeSystem& system, std::span<const double> x, std::span<const double> errors) const;
  double error_of(const OdeSystem& system, std::size_t segment, std::span<const double> x,
                  std::span<const double> errors) const;
  Outcome judge(const OdeSystem& system, std::span<const double> x);
  bool factorise(double a, double b);
  bool take_derivatives(OdeSystem& system, double t, std::span<const double> x);

  VelocitySystem linear_;
  double tolerance_;
  SolverStatistics& statistics_;
  Linearisation of_friction_;
  ErrorScales scales_;
  std::vector<double> f0_, f1_, rate_, work_, new_x_, errors_, remembered_;
  std::vector<double> u_[4];
  double error_ = 0.0;
  double gamma_ = 0.0;  ///< of the last two_stages()
  double after_ = -std::numeric_limits<double>::infinity();
  double before_ = std::numeric_limits<double>::infinity();
};

}  // namespace takt
