#pragma once
// From what a scenario says about drives, power, grippers and trajectories to the dynamics of each robot in
// the cell model.
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// After all components, robots and grippers are in the cell. Throws ScenarioError if a robot of a process at
/// LoD 2 or above cannot be dynamic, saying why; a robot that is kinematic keeps the reason for later.
void add_dynamics(const Scenario& scenario, CellModel& cell);

}  // namespace takt
