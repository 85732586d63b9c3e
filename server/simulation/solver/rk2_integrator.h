#pragma once
// Explicit Runge-Kutta of order two (Heun), the thesis' Rkfix2. For the substitute springs (a double real
// pole at -sqrt(g / allowed error) = -313 1/s) it is stable up to 2/313 s = 6.39 ms.
#include <vector>

#include "server/simulation/solver/integrator.h"

namespace takt {

class Rk2Integrator final : public Integrator {
 public:
  explicit Rk2Integrator(int state_count);

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  std::vector<double> k1_, k2_, trial_;
};

}  // namespace takt
