#pragma once
// Inertias of links for which a URDF has none, from their shapes: many files of industrial robots have meshes and no masses.
#include <optional>
#include <vector>

#include "server/scenario/urdf_arm.h"

namespace takt {

/// Of each link in `below_base` without <inertial>, in the frame of the link: such links share `mass_kg` by the volume of
/// their shapes (urdf_meshes()), at even density; objects that bound no solid count as their convex hulls. std::nullopt for
/// links with <inertial>, and for those whose shapes have no volume. Throws UrdfError as urdf_meshes(), and where no link
/// takes a share; MeshError for a mesh file that cannot be read.
std::vector<std::optional<BodyInertia>> urdf_shape_inertias(const UrdfArm& arm, double mass_kg);

}  // namespace takt
