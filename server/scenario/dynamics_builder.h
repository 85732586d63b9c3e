#pragma once
// From what a scenario says about drives, power, grippers and trajectories to the dynamics of each robot in
// the cell model.
#include <vector>

#include "server/scenario/scenario.h"
#include "server/scenario/urdf_arm.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// After all components, robots and grippers are in the cell. Throws ScenarioError if a robot of a process at
/// LoD 2 or above cannot be dynamic, saying why; a robot that is kinematic keeps the reason for later.
/// `arms`: by robot.
void add_dynamics(const Scenario& scenario, const std::vector<UrdfArm>& arms, CellModel& cell);

}  // namespace takt
