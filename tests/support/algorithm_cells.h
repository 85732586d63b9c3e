#pragma once
// A random cell under any of the interaction algorithms. In chains of Parts of very different size, the modes
// are many times faster than those of single connections; softer springs let tests step through them in
// bounded time.
#include <memory>

#include "tests/support/random_assembly.h"

namespace takt::test {

inline constexpr double kSoftError_m = 1e-3;    ///< static position error that the weight causes
inline constexpr double kChainStep_s = 2.5e-5;  ///< holds for all assemblies of RandomCell with it

inline std::shared_ptr<CellModel> under_algorithm(const RandomCell& cell, InteractionAlgorithm algorithm) {
  auto model = std::make_shared<CellModel>(*cell.model());
  model->interaction.algorithm = algorithm;
  model->step_s = model->description.step_s = kChainStep_s;
  for (const int part : cell.parts) {
    Component& c = model->components[static_cast<std::size_t>(part)];
    c.substitute = substitute_parameters(c.mass_kg, c.I_BBcm_B, 9.80665, kSoftError_m, 1.0);
  }
  return model;
}

}  // namespace takt::test
