#pragma once
// A serial arm out of a URDF: the chain from a base link to a flange link. Only the joints of the chain move. Other
// joints, of fingers or of another arm, stand at one position, so that each other link is fixed to one of the chain,
// or carries the base.
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "plant_models/mechanics/multibody_tree.h"
#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/robot/robot_link.h"
#include "server/scenario/urdf_robot.h"

namespace takt {

/// Links of the file at the ends of an arm's chain.
struct UrdfEnds {
  std::size_t base = 0, flange = 0;
  bool assumed = false;  ///< the tree of the file decides about one of them
};
/// An empty name is the one of ROS, base_link or tool0, where the file has such a link. Else the base is the root, and the
/// flange the end of the moving joints: the link where they branch, or the last one, and what it carries alone by fixed joints.
/// Throws UrdfError for a name that no link has, and where the joints branch before one moves.
UrdfEnds urdf_ends(const UrdfRobot& robot, const std::string& base_link, const std::string& flange_link);

struct UrdfArm {
  UrdfRobot robot;
  std::string base_link, flange_link;
  ArmModel arm;
  /// All links of the file. First the base link and those below it: a link follows the one that carries it,
  /// else the order is that of the file. Last the links above and beside the base link.
  std::vector<RobotLink> links;
  /// Positions at which joints beside the chain stand, by joint of the file; 0 for those of the chain (rad or m).
  std::vector<double> standing;
  /// Names of the moving joints beside the chain.
  std::vector<std::string> standing_joints;
  /// Of the base link and those below it, the first of `links`: the index in robot.links.
  std::vector<std::size_t> below_base;
  /// What takt assumes where the file states nothing, and where the file's world is not the scenario's: one sentence
  /// each, with file and line.
  std::vector<std::string> remarks;
};

/// Fixed joints are folded into their neighbours. Accepted are 1 to kMaxJoints moving joints; revolute,
/// continuous and prismatic joints whose axis has a direction; limits with lower < upper (continuous joints: +-2 pi).
/// A velocity that is missing, 0 or less is not stated: pi rad/s or 1 m/s is assumed; such an effort is unlimited (0).
/// Joints beside the chain stand at 0, at the limit that is nearest to 0, or
/// where a joint that they mimic leads them. Throws UrdfError for all else, and as read_urdf() and urdf_ends().
UrdfArm read_urdf_arm(const std::filesystem::path& file, const std::string& base_link,
                      const std::string& flange_link, const PackageFolders& packages = {});

struct UrdfInertias {
  /// Inertia of the links from each joint of the arm up to the next one, in the joint's frame.
  std::vector<BodyInertia> links;
  /// Of figures that are doubtful but can be computed with, one sentence each with file, line and element.
  std::vector<std::string> remarks;
};

/// Separate from the kinematics, which need no inertias. Throws UrdfError for a joint that moves no
/// <inertial>, a physically impossible inertia (inertia_problem()), and a missing mesh file: the meshes are
/// not used here, but a missing file shows that the robot is incomplete. A mesh of a ROS package (package://) may be
/// missing. With `mass_kg` the links without <inertial> share it (urdf_shape_inertias()), which a remark states.
UrdfInertias urdf_inertias(const UrdfArm& arm, std::optional<double> mass_kg = std::nullopt);

}  // namespace takt
