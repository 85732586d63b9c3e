#pragma once
// The errors that solvers with error control allow the states of a cell.
#include <vector>

#include "server/simulation/solver/ode_system.h"

namespace takt {

class ErrorScales {
 public:
  /// `looseness`: of absolute states. `most_rotation_rad_per_s`: bound of the scales of the angular velocities of Parts.
  ErrorScales(const OdeSystem& system, double looseness, double most_rotation_rad_per_s);

  std::size_t count() const { return scales_.size(); }
  /// Error of state i at the tolerance 1, > 0, where its absolute value is `size`.
  double allowed(std::size_t i, double size) const { return relative_[i] * size + scales_[i]; }

 private:
  std::vector<double> scales_, relative_;  ///< the latter 1, or 0 for PlantModel::absolute_states()
};

}  // namespace takt
