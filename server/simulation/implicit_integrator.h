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
// Where pairs are stiff (surface contact) the method is the linearly implicit one of Euler with the coupled
// A,
//   (I - h A) k = f(t, x) + h f_t,  x(t + h) = x + h k.
// For ROS2 looks at f a whole step ahead: there a body that flies free at t is deep inside another, and the
// force that A knows nothing of throws it back with more than it came with (0.3 kg at 0.5 m/s on a layer
// of 1.3 MN/m: thrown out from 2 ms on). The method of Euler takes energy out of such an impact, at any step.
// What begins to press within a step is not in A: where that changes the velocity of a body that nothing
// touched before by more than 20 mm/s, the step is taken once more in 8 pieces.
//
// Per step: two evaluations, one Jacobian by the models, one factorisation on a pattern that was analysed at
// construction, two solutions. No iteration, so the time of a step has a bound.
#include <memory>
#include <vector>

#include "server/simulation/integrator.h"
#include "server/simulation/static_lu.h"
#include "server/simulation/velocity_system.h"

namespace takt {

class ImplicitIntegrator final : public Integrator {
 public:
  ImplicitIntegrator(const SolverParameters& parameters, const OdeSystem& system);

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  bool factorise(double gamma_h);
  void solve(std::vector<double>& k);
  bool advance_coupled(OdeSystem& system, double t, double h, std::span<double> x);
  bool advance_stiff_pairs(OdeSystem& system, double t, double h, std::span<double> x);
  bool step_stiff_pairs(OdeSystem& system, double t, double h, std::span<double> x);
  /// How much a body's velocity is wrong because of what J at the beginning did not know of (m/s).
  double unforeseen_m_per_s(OdeSystem& system, double t_end, double h, std::span<const double> x);
  void linearise_coupled(OdeSystem& system, double t, std::span<const double> x);

  std::vector<int> implicit_states_;  ///< states with entries, ascending
  StaticLu lu_;                       ///< over those
  std::vector<double> values_, rate_, right_side_;
  std::vector<double> k1_, k2_, trial_, begin_;
  std::unique_ptr<VelocitySystem> coupled_;  ///< null: A of the models alone
};

}  // namespace takt
