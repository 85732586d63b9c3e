#pragma once
// An SDFormat file as models of links and joints: worlds and models, as far as they describe what a cell has. Poses of all
// frames are resolved, nested and included models are in the model that has them.
//
// W is the frame of the world, or of the file's one model. Lengths in m, angles in rad. Conventions of the format: in
// version 1.4 and before, axes of joints are in the frame of the model.
#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "idl/common/ros_packages.h"
#include "plant_models/spatial.h"
#include "server/scenario/urdf_robot.h"

namespace takt {

struct SdfLink {
  std::string name;  ///< with those of the nested models that have it: gripper::finger
  Pose X_WL;
  std::optional<UrdfInertial> inertial;
  bool is_massless = false;  ///< the file states a mass of 0, as Bullet has it of what stands
  std::vector<UrdfShape> visuals, collisions;  ///< file names are absolute
  std::optional<std::array<float, 4>> color;   ///< of the first visual that states one
};

struct SdfJoint {
  std::string name;
  /// floating: a kind that takt does not move, named in `kind`.
  UrdfJointType type = UrdfJointType::fixed;
  std::string kind;                   ///< as the file has it
  std::optional<std::size_t> parent;  ///< link; none: the world
  std::size_t child = 0;
  Pose X_WJ;
  Vec3 axis = Vec3::UnitZ();  ///< in J
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  double velocity = 0.0, effort = 0.0;  ///< 0: not stated
  std::string place;                    ///< file and line
};

struct SdfModel {
  std::string name;
  bool is_static = false;
  std::vector<SdfLink> links;
  std::vector<SdfJoint> joints;
};

struct SdfWorld {
  std::string name;
  Vec3 gravity_m_per_s2{0.0, 0.0, -9.80665};
  std::vector<SdfModel> models;
  std::map<std::string, int> left_out;  ///< elements that takt does not model, with their number
  std::vector<std::string> notes;       ///< whole sentences, of what takt reads in another way
};

struct SdfOptions {
  PackageFolders packages;         ///< where model://NAME and package://NAME are searched
  bool leave_out_missing = false;  ///< a model that is not found becomes a note
};

/// Throws DescriptionError, with file, line, element, what was found and what is allowed, for files that are not SDFormat,
/// other versions than 1.x, names that are missing or used twice, numbers that are not finite, frames that are unknown or
/// relative to each other in a loop, unknown kinds of geometry and joints, and for files that are not found.
SdfWorld read_sdf(const std::filesystem::path& file, const SdfOptions& options = {});

}  // namespace takt
