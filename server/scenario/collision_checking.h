#pragma once
// The section `collision_checking` of a scenario turned into the bodies and pairs that a cell checks.
#include "server/scenario/scenario.h"
#include "server/scenario/urdf_arm.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Fills cell.clearance and the names in its description, after components, pairs, robots and grippers.
/// Checked are
/// - Gripper with Ground: the report pairs of pair generation (thesis 3.2.2);
/// - links of robots with Grounds, and links and grippers of one robot with those of another;
/// - links and grippers with Parts (the monitor skips a Part while a gripper of the same robot holds it);
/// - links and gripper of one robot with each other, unless the same or successive joints move them;
/// - Parts with Parts and Grounds, by their meshes, unless a thread joins the two.
/// `arms`: by robot; `meshes`: by component.
/// Excluded are pairs without relative motion, and pairs that the scenario ignores. Throws ScenarioError for
/// a name that fits no pair, UrdfError, MeshError.
void add_collision_checking(const Scenario& scenario, const std::vector<UrdfArm>& arms,
                            const std::vector<TriangleMesh>& meshes, CellModel& cell);

/// True if the name is that of a Part deleted by request: rules that name it have no effect and are no
/// mistake.
bool fits_a_deleted_part(const Scenario& scenario, const std::string& pattern);

}  // namespace takt
