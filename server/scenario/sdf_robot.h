#pragma once
// Links and joints of an SDFormat model as a URDF robot. Only sdf_cell.cpp uses it.
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/scenario/sdf_world.h"

namespace takt {

struct SdfRobot {
  std::string urdf;
  std::string base_link, flange_link;
  Pose X_WR;
  std::vector<std::string>
      fingers;  ///< two prismatic joints that the flange carries, with shapes, and no others; else none
  std::vector<double> initial_joints;  ///< of the chain from base to flange: nearest to 0 within the limits
  std::vector<std::string> notes;
};

/// The robot of these links of the model, which its joints join. `mesh_name`: the name that the URDF has for the mesh file
/// of a shape, or none to leave the shape out. None: they have no moving joint.
std::optional<SdfRobot> sdf_robot(
    const SdfModel& model, const std::vector<std::size_t>& links,
    const std::function<std::optional<std::string>(const UrdfShape&)>& mesh_name);

/// Does takt move this joint?
bool moves(const SdfJoint& joint);

}  // namespace takt
