#pragma once
// A linearly implicit method of order two with a fixed step and a bounded cost: the W-method ROS2 (Verwer,
// Spee, Blom, Hundsdorfer: A second-order Rosenbrock method applied to photochemical dispersion problems,
// SIAM J. Sci. Comput. 20, 1999),
//   (I - g h A) k1 = f(t, x) + g h f_t
//   (I - g h A) k2 = f(t + h, x + h k1) - 2 k1 - g h f_t
//   x(t + h) = x + 3/2 h k1 + 1/2 h k2,        g = 1 - 1/sqrt(2): L-stable where A is the Jacobian.
// The order holds for any A and f_t. So A has the models' own stiffness only (jacobian_pattern), without the
// couplings between them, and models without entries are treated by Heun's explicit method, as in rk2.
// SystemMatrix::coupled: A is that of velocity_system.h, with the forces between models and the secant of
// friction.
//
// With stiff pairs (surface contact) A is the coupled one, and ROS2 first tries the whole communication step.
// If its error is too large (a vibration, an impact, a closing grip), the step is divided into as few pieces
// as possible of ROS34PW2, which is of order three, with error control; during the next kMaxStepsOfOne steps
// that method is tried first. The bound of the cost is a number of attempts: at most kMaxAttempts per
// communication step, including the first and rejected ones. So a piece is never smaller than the rest of the
// step divided by the remaining attempts. A piece of that size is accepted with any error
// (SolverStatistics::forced_steps); if the error is far too large, the linearly implicit method of Euler
// computes it, which dissipates the energy of unresolved motion.
//
// A and its factors serve up to kMaxStepsOfOne communication steps, as long as the error of each is far below
// the tolerance and the same models are awake. They are discarded at discontinuities and whenever the state
// is saved.
//
// Work per communication step: without stiff pairs two evaluations, one Jacobian by the models, one
// factorisation on a pattern that was analysed at construction, two solutions; with them at most
// kMaxAttempts Jacobians, 2 kMaxAttempts factorisations, 4 kMaxAttempts evaluations and solutions.
#include <memory>
#include <vector>

#include "server/simulation/solver/integrator.h"
#include "server/simulation/solver/rosenbrock_step.h"
#include "server/simulation/solver/sparse_lu.h"

namespace takt {

class ImplicitIntegrator final : public Integrator {
 public:
  static constexpr int kMaxAttempts = 32;
  static constexpr int kMaxStepsOfOne = 20;

  ImplicitIntegrator(const SolverParameters& parameters, const OdeSystem& system);
  void restart() override { forget(); }
  void forget() override;

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  bool factorise(double gamma_h);
  void solve(std::vector<double>& k);
  bool advance_coupled(OdeSystem& system, double t, double h, std::span<double> x);
  bool advance_stiff_pairs(OdeSystem& system, double t, double h, std::span<double> x);
  double limit_piece(const OdeSystem& system, double now, double end, double least);
  /// True: the trial is accepted. False: `size` is the next size, or in a forced piece no step is possible.
  bool try_piece(OdeSystem& system, double now, double& size, bool forced, std::span<const double> x);
  void take_four_stages();
  void accept(const OdeSystem& system, double h, std::span<double> x);
  bool is_kept(const OdeSystem& system, double h) const;
  /// The whole step with A and its factors of an earlier one. False: a new A is needed.
  bool step_again(OdeSystem& system, double t, double h, std::span<const double> x);
  void keep(const OdeSystem& system, double h);

  std::vector<int> implicit_states_;  ///< states with entries, ascending
  SparseLu lu_;                       ///< of that pattern
  std::vector<double> values_, rate_, right_side_;
  std::vector<double> k1_, k2_, trial_;
  std::unique_ptr<RosenbrockStep> coupled_;  ///< null: A of the models alone
  enum class Method : std::uint8_t { two_stages, four_stages };
  Method method_ = Method::two_stages;
  int four_stages_left_ = 0;                ///< number of steps until two stages are tried again
  int steps_left_ = 0;                      ///< that the present A and its factors may serve
  double kept_h_ = 0.0;                     ///< of these
  std::vector<std::size_t> kept_segments_;  ///< awake segments at that time
  double after_ = 0.0;                      ///< f has a corner there; it is evaluated from there on
};

}  // namespace takt
