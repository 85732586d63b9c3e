#pragma once
// A linearly implicit method of order two with a fixed step and a bounded cost: the W-method ROS2 (Verwer,
// Spee, Blom, Hundsdorfer: A second-order Rosenbrock method applied to photochemical dispersion problems,
// SIAM J. Sci. Comput. 20, 1999),
//   (I - g h A) k1 = f(t, x) + g h f_t
//   (I - g h A) k2 = f(t + h, x + h k1) - 2 k1 - g h f_t
//   x(t + h) = x + 3/2 h k1 + 1/2 h k2,        g = 1 - 1/sqrt(2): L-stable where A is the Jacobian.
// Its order holds for any A and f_t. So A has the models' own stiffness only (jacobian_pattern), without the
// couplings between them, and models without entries are treated by Heun's explicit method, as in rk2.
// SystemMatrix::coupled: A is that of velocity_system.h, with the forces between models, secant of friction.
//
// Where pairs are stiff (surface contact) A is the coupled one, and a communication step is tried as a whole
// with ROS2 first. Where its error is too large (a vibration, an impact, a grip that closes) the step is
// taken in as few pieces as possible of ROS34PW2, which is of order three, with error control; for the next
// kMaxStepsOfOne steps that method is tried first. The bounded cost is counted in attempts: at most
// kMaxAttempts per communication step, the first one and rejected ones included. So a piece is never smaller
// than what is left of the step over what is left of the attempts. A piece of that size is taken whatever its
// error (SolverStatistics::forced_steps), far beyond it by the linearly implicit method of Euler, which takes
// energy out of whatever it cannot resolve.
//
// A and its factors serve up to kMaxStepsOfOne communication steps, as long as the error of each is far
// below what is allowed and the same models are awake. They are forgotten where anything jumps, and where the
// state is saved.
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
  /// True: the trial is to be accepted. False: size is what to try next, or no step is possible where forced.
  bool try_piece(OdeSystem& system, double now, double& size, bool forced, std::span<const double> x);
  void take_four_stages();
  void accept(const OdeSystem& system, double h, std::span<double> x);
  bool is_kept(const OdeSystem& system, double h) const;
  /// The whole step with A and its factors of an earlier one. False: it takes another.
  bool step_again(OdeSystem& system, double t, double h, std::span<const double> x);
  void keep(const OdeSystem& system, double h);

  std::vector<int> implicit_states_;  ///< states with entries, ascending
  StaticLu lu_;                       ///< over those
  std::vector<double> values_, rate_, right_side_;
  std::vector<double> k1_, k2_, trial_;
  std::unique_ptr<RosenbrockStep> coupled_;  ///< null: A of the models alone
  enum class Method : std::uint8_t { two_stages, four_stages };
  Method method_ = Method::two_stages;
  int four_stages_left_ = 0;                ///< steps before two stages are tried again
  int steps_left_ = 0;                      ///< that the present A and its factors may serve
  double kept_h_ = 0.0;                     ///< of these
  std::vector<std::size_t> kept_segments_;  ///< awake when it was made
  double after_ = 0.0;                      ///< f has a corner there; it is evaluated from there on
};

}  // namespace takt
