#pragma once
// From what a scenario says about surface contact to surfaces and pairs.
#include "server/geometry/triangle_mesh.h"
#include "server/scenario/scenario.h"
#include "server/simulation/cell_model.h"

namespace takt {

/// Fills cell.contact where the scenario has a section `contact` or a process of level of detail 3.
/// `meshes`: by component. Throws ScenarioError for names that fit nothing.
void add_contact(const Scenario& scenario, const std::vector<TriangleMesh>& meshes, CellModel& cell);

}  // namespace takt
