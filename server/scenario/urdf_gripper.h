#pragma once
// A parallel gripper out of a URDF: two fingers that travel in opposite directions, on prismatic joints or by a linkage.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario.h"
#include "server/scenario/urdf_arm.h"

namespace takt {

/// What the file says of a gripper. Frame G: origin between the closed grip faces, y along the travel of the left
/// finger, z from the hand to the fingers.
struct UrdfGripper {
  Pose X_FG;
  Pose X_GT;  ///< of a fixed link whose name has "tcp"; else between the tips of the fingers
  std::vector<NamedMesh> body;  ///< in G
  std::vector<NamedMesh> jaw;   ///< of the left finger; the grip face is at y = 0
  double max_width_m = 0.0;     ///< at the limits of the joints
  double jaw_speed_m_per_s = 0.0, max_force_N = 0.0;
  double mass_kg = 0.0, jaw_mass_kg = 0.0;  ///< 0: the file has none
  std::vector<std::string> links, joints;   ///< of hand and fingers, which are not of the arm
  std::vector<std::string> remarks;  ///< what takt models in another way than the file, one sentence each
};

/// `fingers`: the names of two joints; empty: the two prismatic joints that the flange carries, else those of a linkage
/// (finger_linkage.h), whose other links stand as a part of the body. Shapes are those of <collision>, of a link without
/// them those of <visual>. Throws UrdfError for joints that are no such fingers, and for links without shapes; MeshError
/// for a mesh file that cannot be read.
UrdfGripper urdf_gripper(const UrdfArm& arm, const std::string& flange_link,
                         const std::vector<std::string>& fingers);

/// The scenario with the grippers that have `fingers` completed from the URDF of their robot; none if no gripper has
/// them. Their meshes go to `files`, their links and joints leave the arm (`arms`: by robot), and
/// each remark goes to `remark` with the name of the robot. Throws as
/// urdf_gripper(), and ScenarioError for a value that neither the scenario nor the URDF has.
std::optional<Scenario> with_fingers(
    const Scenario& scenario, std::vector<UrdfArm>& arms, MeshFiles& files,
    const std::function<void(const std::string& robot, const std::string& sentence)>& remark);

}  // namespace takt
