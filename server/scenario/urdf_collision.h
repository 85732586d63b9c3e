#pragma once
// The <collision> geometry of a robot's links. Apart from urdf_reader.h, which reads the kinematics: what is
// read here only ever serves collision checking.
#include <filesystem>
#include <string>
#include <vector>

#include "server/geometry/convex/rounded_shape.h"
#include "server/scenario/urdf_reader.h"

namespace takt {

struct UrdfLinkShapes {
  std::string link;
  int joint = -1;                    ///< index of the joint that moves it; -1: it stands with the base
  std::vector<RoundedShape> shapes;  ///< in the frame of that joint, or of the base link
};

/// All links that have <collision> elements and are at or below `base_link`, in the order of the file. `urdf`
/// is what read_urdf_arm() made of the file. Boxes and spheres are exact; a cylinder becomes the prism of
/// kCylinderSides sides around it, at most 0.5 % thicker; a mesh becomes the convex hull of each object in
/// it. Mesh files are relative to the URDF file. Throws UrdfError naming file, line, column and link,
/// MeshError for a mesh file.
std::vector<UrdfLinkShapes> read_urdf_collision(const std::filesystem::path& file, const UrdfArm& urdf,
                                                const std::string& base_link);

inline constexpr int kCylinderSides = 32;

}  // namespace takt
