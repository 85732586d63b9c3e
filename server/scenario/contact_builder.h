#pragma once
// From what a scenario says about surface contact to surfaces and pairs.
#include <string>

#include "server/geometry/mesh/quality.h"
#include "server/geometry/mesh/triangle_mesh.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Fills cell.contact where the scenario has a section `contact` or a process of level of detail 3.
/// `meshes`: by component. Throws ScenarioError for names that fit nothing.
void add_contact(const Scenario& scenario, const std::vector<TriangleMesh>& meshes, CellModel& cell);

/// Fills GripperModel::friction: of jaws on Parts, as the section says for surface contact, at every level.
void add_grip_friction(const Scenario& scenario, CellModel& cell);

/// What the mesh of a component (a jaw: gripper/left_jaw) will be like in contact, for find_contact_risks:
/// into which edge it is divided, and whether it can carry elements. A role that the scenario states
/// counts more than `usually_carries_elements`.
ContactMeshOptions contact_mesh_options(const Scenario& scenario, const std::string& component,
                                        const TriangleMesh& mesh, bool usually_carries_elements);

}  // namespace takt
