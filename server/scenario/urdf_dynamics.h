#pragma once
// The dynamics of a URDF: <inertial> of the links of an arm, or a whole tree of links with everything that
// moves. Apart from urdf_reader.h, which reads the kinematics of one chain: LoD 1 needs none of this, and a
// file without inertias is good enough there.
#include <filesystem>
#include <string>
#include <vector>

#include "plant_models/mechanics/joint_coupling.h"
#include "plant_models/mechanics/multibody_tree.h"
#include "server/scenario/urdf_reader.h"

namespace takt {

struct UrdfInertias {
  /// Of the link after each joint of an arm, in the joint's frame, with all links that are fixed to it (the
  /// flange and what the file mounts there, too).
  std::vector<BodyInertia> links;
  /// Of doubtful figures that can be computed with, one sentence each with file, line and element.
  std::vector<std::string> remarks;
};

/// `urdf` is what read_urdf_arm() made of the file. Throws
/// UrdfError naming file, line and element: a link that moves without <inertial> anywhere on it, a mass that
/// is not finite or negative, a tensor that is not positive semidefinite, a mesh file that is not there.
UrdfInertias read_urdf_inertias(const std::filesystem::path& file, const UrdfArm& urdf,
                                const std::string& base_link);

struct UrdfTreeOptions {
  bool inertias_needed = true;  ///< refuse moving links without any <inertial>
  bool limits_needed = false;   ///< refuse continuous joints, which have no range
};

/// Where a link of the file went: it is fixed to link `joint` of the tree (-1: the base) at X_JL.
struct UrdfFrame {
  std::string link;
  int joint = -1;
  Pose X_JL;
};

struct UrdfTree {
  TreeModel tree;                    ///< depth first in the order of the file; standard gravity along -z
  std::vector<MimicJoint> mimics;    ///< joints that follow others
  std::vector<UrdfFrame> frames;     ///< all links at and below the base link
  std::vector<std::string> remarks;  ///< as in UrdfInertias
};

/// All that is at and below `base_link`: fixed (folded into the link above), revolute, continuous and
/// prismatic joints. Limits of continuous joints are infinite where the file has none. Throws UrdfError as
/// above, and for loops and links with several parents, joints of other types, axes without direction, mimic
/// joints that follow what is not there, themselves, or a ring, more than kMaxJoints moving joints.
UrdfTree read_urdf_tree(const std::filesystem::path& file, const std::string& base_link,
                        const UrdfTreeOptions& options = {});

}  // namespace takt
