#pragma once
// Builds the dynamics of each robot in the cell model from a scenario's drives, power, grippers and
// trajectories.
#include <vector>

#include "server/scenario/scenario.h"
#include "server/scenario/urdf_arm.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// After all components, robots and grippers are in the cell. Throws ScenarioError with the reason if a robot
/// of a process at LoD 2 or above cannot be dynamic; for a kinematic robot the model stores the reason.
/// `arms`: by robot.
void add_dynamics(const Scenario& scenario, const std::vector<UrdfArm>& arms, CellModel& cell);

}  // namespace takt
