#pragma once
// Poses, inertias, shapes and colours of SDFormat elements. Only readers of SDFormat include this.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "server/scenario/sdf_files.h"
#include "server/scenario/urdf_robot.h"
#include "server/scenario/xml_file.h"

namespace takt {

/// Of a <pose>: x y z and fixed-axis roll, pitch, yaw, in degrees where it says so, or a quaternion (x y z w).
Pose sdf_pose(const XmlFile& file, const XmlFile::Element& pose);

/// Without <mass> or <inertia> the format's own: 1 kg, 1 kg m^2.
UrdfInertial sdf_inertial(const XmlFile& file, const XmlFile::Element& element, const std::string& where,
                          const Pose& X_LC);

/// The <geometry> of a <visual> or <collision>. A plane becomes a plate below it, an ellipsoid a scaled sphere, a capsule a
/// cylinder with two spheres. Shapes that takt does not have become notes of `files`.
std::vector<UrdfShape> sdf_shapes(const XmlFile& file, const XmlFile::Element& element,
                                  const std::string& where, SdfFiles& files);

/// Of the <material> of a <visual>, if it states <diffuse> or <ambient>.
std::optional<std::array<float, 4>> sdf_color(const XmlFile& file, const XmlFile::Element& visual,
                                              const std::string& where);

}  // namespace takt
