#pragma once
// The section `collision_checking` of a scenario turned into the bodies and pairs that a cell checks.
#include "server/scenario/scenario.h"
#include "server/scenario/urdf_arm.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Fills cell.clearance and the names in its description. Components, pairs, robots and grippers must be
/// there. Checked are
/// - Gripper with Ground: the report pairs of pair generation (thesis 3.2.2);
/// - links of robots with Grounds, and links and grippers of one robot with those of another;
/// - links and grippers with Parts (while a gripper of the same robot holds the Part the monitor passes over
///   them);
/// - links and gripper of one robot with each other, unless the same or successive joints move them;
/// - Parts with Parts and Grounds, by their meshes, unless a thread joins the two.
/// `arms`: by robot; `meshes`: by component.
/// Left out is what cannot move relative to each other, and what the scenario ignores. Throws ScenarioError
/// for a name that fits nothing, UrdfError, MeshError.
void add_collision_checking(const Scenario& scenario, const std::vector<UrdfArm>& arms,
                            const std::vector<TriangleMesh>& meshes, CellModel& cell);

/// Of a Part that was deleted by request: rules that name it say nothing, and are no mistake.
bool fits_a_deleted_part(const Scenario& scenario, const std::string& pattern);

}  // namespace takt
