#pragma once
// Builds surfaces and pairs from a scenario's section on surface contact.
#include <string>

#include "server/geometry/mesh/quality.h"
#include "server/geometry/mesh/triangle_mesh.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Fills cell.contact if the scenario has a section `contact` or a process of level of detail 3. `meshes`: by
/// component. Throws ScenarioError for names that fit no component or pair.
void add_contact(const Scenario& scenario, const std::vector<TriangleMesh>& meshes, CellModel& cell);

/// Fills GripperModel::friction, of jaws on Parts, from the section on surface contact, at every level.
void add_grip_friction(const Scenario& scenario, CellModel& cell);

/// Options of check_mesh_quality for the mesh of a component (a jaw: gripper/left_jaw): the edge to which it
/// is divided, and whether it can carry elements. A role stated in the scenario replaces
/// `usually_carries_elements`.
MeshQualityOptions mesh_quality_options(const Scenario& scenario, const std::string& component,
                                        const TriangleMesh& mesh, bool usually_carries_elements);

}  // namespace takt
