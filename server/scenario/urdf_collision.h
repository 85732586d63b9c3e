#pragma once
// The <collision> geometry of a robot's links, which only ever serves collision checking.
#include <string>
#include <vector>

#include "server/geometry/convex/rounded_shape.h"
#include "server/scenario/urdf_arm.h"

namespace takt {

struct UrdfLinkShapes {
  std::string link;
  int joint = -1;                    ///< index of the joint that moves it; -1: it stands with the base
  std::vector<RoundedShape> shapes;  ///< in the frame of that joint, or of the base link (m)
};

/// All links that have <collision> elements and are at or below the base link, in the order of the file. Boxes and
/// spheres are exact; a cylinder becomes the prism of kCylinderSides sides around it, at most 0.5 % thicker; a mesh
/// becomes the convex hull of each object in it. Mesh files are relative to the URDF file. Throws UrdfError for sizes that
/// are not positive, mesh files that are missing or without a hull, MeshError for a mesh file that cannot be read.
std::vector<UrdfLinkShapes> urdf_collision(const UrdfArm& arm);

inline constexpr int kCylinderSides = 32;

}  // namespace takt
