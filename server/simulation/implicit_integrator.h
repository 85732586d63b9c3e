#pragma once
// A linearly implicit method of order two with a fixed step and a bounded cost: the W-method ROS2 (Verwer,
// Spee, Blom, Hundsdorfer: A second-order Rosenbrock method applied to photochemical dispersion problems,
// SIAM J. Sci. Comput. 20, 1999),
//   (I - g h A) k1 = f(t, x) + g h f_t
//   (I - g h A) k2 = f(t + h, x + h k1) - 2 k1 - g h f_t
//   x(t + h) = x + 3/2 h k1 + 1/2 h k2,        g = 1 - 1/sqrt(2): L-stable where A is the Jacobian.
// Its order holds for any A and f_t. So A has the models' own stiffness only (jacobian_pattern), without the
// couplings between them, and models without entries are treated by Heun's explicit method, as in rk2.
//
// Per step: two evaluations, one Jacobian by the models, one factorisation on a pattern that was analysed at
// construction, two solutions. No iteration, so the time of a step has a bound.
#include <vector>

#include "server/simulation/integrator.h"
#include "server/simulation/static_lu.h"

namespace takt {

class ImplicitIntegrator final : public Integrator {
 public:
  explicit ImplicitIntegrator(const OdeSystem& system);

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  bool factorise(double gamma_h);
  void solve(std::vector<double>& k);

  std::vector<int> implicit_states_;  ///< states with entries, ascending
  StaticLu lu_;                       ///< over those
  std::vector<double> values_, rate_, right_side_;
  std::vector<double> k1_, k2_, trial_;
};

}  // namespace takt
