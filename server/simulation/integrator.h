#pragma once
// Solvers by name. A solver advances the state over one communication step during which all discrete facts
// (set-points, connections) stay as they are.
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/ode_system.h"

namespace takt {

class Integrator {
 public:
  virtual ~Integrator() = default;
  /// x(t) -> x(t + h) in place. The caller has just called system.update_motion(t, x).
  virtual void advance(OdeSystem& system, double t, double h, std::span<double> x) = 0;
};

/// Explicit Runge-Kutta of order two (Heun), the thesis' Rkfix2. For the substitute springs (a double real
/// pole at -sqrt(g / allowed error) = -313 1/s) it is stable up to 2/313 s = 6.39 ms.
class Rk2Integrator final : public Integrator {
 public:
  explicit Rk2Integrator(int state_count);
  void advance(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  std::vector<double> k1_, k2_, trial_;
};

/// Names make_integrator() accepts, for error texts.
std::span<const std::string_view> solver_names();
/// Throws std::invalid_argument for an unknown name.
std::unique_ptr<Integrator> make_integrator(std::string_view name, int state_count);

}  // namespace takt
