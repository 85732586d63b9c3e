#include "server/simulation/integrator.h"

#include <array>
#include <stdexcept>

#include "server/simulation/rk2_integrator.h"

namespace takt {

namespace {
constexpr std::array<std::string_view, 1> kSolverNames{"rk2"};
}

std::span<const std::string_view> solver_names() {
  return kSolverNames;
}

std::unique_ptr<Integrator> make_integrator(const SolverParameters& parameters, const OdeSystem& system) {
  if (parameters.name == "rk2") return std::make_unique<Rk2Integrator>(system.state_count());
  throw std::invalid_argument("unknown solver '" + parameters.name + "'; allowed: rk2");
}

}  // namespace takt
