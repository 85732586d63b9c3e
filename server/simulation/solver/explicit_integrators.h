#pragma once
// Explicit Runge-Kutta methods with a fixed step.
#include <array>
#include <vector>

#include "server/simulation/solver/integrator.h"

namespace takt {

/// Explicit Runge-Kutta of order two (Heun), the thesis' Rkfix2. For the substitute springs (a double real
/// pole at -sqrt(g / allowed error) = -313 1/s) it is stable up to 2/313 s = 6.39 ms.
class Rk2Integrator final : public Integrator {
 public:
  explicit Rk2Integrator(int state_count);

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  std::vector<double> k1_, k2_, trial_;
};

/// The classical explicit Runge-Kutta method of order four. Stable up to about 2.79 / |pole| on the real axis:
/// for the substitute springs 8.9 ms.
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
