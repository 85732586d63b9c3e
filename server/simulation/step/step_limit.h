#pragma once
// Longest step with which solvers of fixed step follow the substitute forces of levels of detail 1 and 2,
// known at loading from stiffness and damping. A held Part swings with w = sqrt(g / allowed position error),
// whatever its mass; with critical damping Heun's method (rk2, and implicit, which has no Part in its
// separate matrix) is stable up to 2 / w: 6.39 ms at 0.1 mm.
#include <string>

#include "server/simulation/model/cell_model.h"

namespace takt {

/// Longest stable step (s) of `solver` for x'' = -stiffness x - damping x', both per mass; infinity for a
/// method without limit.
double longest_stable_step_s(const SolverParameters& solver, double stiffness_per_s2, double damping_per_s);

struct StepLimit {
  double single_s = 0.0;  ///< of the fastest Part alone
  std::string part;       ///< the fastest one alone
};
StepLimit substitute_step_limit(const CellModel& cell, const SolverParameters& solver);

/// Remark on the step of the solver of levels 1 and 2 (`dynamic`: of level 2, if it has a solver of its own):
/// figures and remedy; empty if the step is right. `refused`: the run would certainly diverge.
std::string step_remark(const CellModel& cell, bool dynamic, bool& refused);

}  // namespace takt
