#pragma once
// The classical explicit Runge-Kutta method of order four. Stable up to about 2.79 / |pole| on the real axis:
// for the substitute springs 8.9 ms.
#include <array>
#include <vector>

#include "server/simulation/solver/integrator.h"

namespace takt {

class Rk4Integrator final : public Integrator {
 public:
  explicit Rk4Integrator(int state_count);

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  std::array<std::vector<double>, 4> k_;
  std::vector<double> trial_;
};

}  // namespace takt
