#pragma once
// URDF text into a serial arm, by liburdfdom. This is the only place that knows urdfdom.
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/robot/robot_link.h"

namespace takt {

/// what() names the file and the element, what was found and what is allowed.
class UrdfError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct UrdfArm {
  std::string text;  ///< the URDF as read
  ArmModel arm;
  std::vector<RobotLink> links{};  ///< all of the file, `base_link` first
};

/// Reads the chain from `base_link` to `flange_link`. Fixed joints are folded into their neighbours; at least
/// one and at most kMaxJoints moving joints; revolute, continuous and prismatic joints with a non-zero axis;
/// limits with lower < upper and positive velocity (continuous joints: +-2 pi).
UrdfArm read_urdf_arm(const std::filesystem::path& file, const std::string& base_link,
                      const std::string& flange_link);

/// The text of a URDF that is well-formed, accepted by urdfdom, and whose joints make no loop.
std::string read_urdf_text(const std::filesystem::path& file);

}  // namespace takt
