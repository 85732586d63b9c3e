#pragma once
// The steps of build_cell, each in a source of its own.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/geometry/surface/shared_mesh.h"
#include "server/scenario/scenario.h"
#include "server/scenario/urdf_arm.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

// mesh_diagnostics.cpp: meshes of components, with notes about repairs, and about defects that would falsify forces
// of surface contact.

/// The file's solid, repaired; a note for each repair and warning. Throws MeshError for a mesh that bounds no
/// solid.
std::shared_ptr<SharedMesh> import_component_mesh(const std::string& component,
                                                  const std::filesystem::path& file, double scale,
                                                  MeshLibrary& library, CellModel& cell);

/// node_poses.cpp: the scenario with the poses that follow from `at_node`; none if no component has it. Throws
/// MeshError.
std::optional<Scenario> placed_at_nodes(const Scenario& scenario, MeshFiles& files);

/// part_pools.cpp: the scenario with the Parts of its pools, at the pose of the first source of their pool; none
/// without pools.
std::optional<Scenario> with_pools(const Scenario& scenario);
/// Fills cell.pools, and parks their Parts in a row far below the cell. After all Parts are in the cell.
void add_pools(const Scenario& scenario, CellModel& cell);

// dynamics_builder.cpp: the dynamics of each robot, from its drives, power, grippers and trajectory.

/// After all components, robots and grippers are in the cell. Throws ScenarioError with the reason if a robot
/// of a process at LoD 2 or above cannot be dynamic; for a kinematic robot the model stores the reason.
/// `arms`: by robot; `meshes`: by component.
void add_dynamics(const Scenario& scenario, const std::vector<UrdfArm>& arms, const SharedMeshes& meshes,
                  CellModel& cell);

// contact_builder.cpp: surfaces and pairs, from the section on surface contact.

/// Fills cell.contact if the scenario has a section `contact` or a process of level of detail 3. `meshes`: by
/// component. Throws ScenarioError for names that fit no component or pair.
void add_contact(const Scenario& scenario, const SharedMeshes& meshes, CellModel& cell);

/// Fills GripperModel::friction, of jaws on Parts, from the section on surface contact, at every level.
void add_grip_friction(const Scenario& scenario, CellModel& cell);

/// How the mesh of a component (a jaw: gripper/left_jaw) is used in surface contact.
struct MeshUse {
  double element_edge_m = 0.0;    ///< to which it is divided
  bool carries_elements = false;  ///< whether it can carry elements
  bool resampled = false;         ///< its needles are replaced, and add_contact notes that
};
/// A role stated in the scenario replaces `usually_carries_elements`.
MeshUse mesh_use(const Scenario& scenario, const std::string& component, SharedMesh& mesh,
                 bool usually_carries_elements);
/// mesh_diagnostics.cpp: a note for each warning of check_mesh_quality, without that of needles that are replaced.
void note_contact_risks(const std::string& component, SharedMesh& mesh, const MeshUse& use, CellModel& cell);

// collision_checking.cpp: the bodies and pairs that a cell checks, from the section `collision_checking`.

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
                            const SharedMeshes& meshes, CellModel& cell);

/// True if the name is that of a Part deleted by request: rules that name it have no effect and are no
/// mistake.
bool fits_a_deleted_part(const Scenario& scenario, const std::string& pattern);

// start_overlap.cpp: Parts that penetrate other Parts or Grounds at the start.

/// Deeper than the contact margin and this share of the thinner body's thickness no fit is: a press fit has a
/// thousandth or two of its diameter.
inline constexpr double kLargestFit = 0.01;

/// Fills cell.start_overlaps, with a note for each. The test uses the meshes (by component) at their initial
/// poses and skips pairs that a thread joins or that `world.allow_overlap` names.
void find_start_overlaps(const Scenario& scenario, const SharedMeshes& meshes, CellModel& cell);

}  // namespace takt
