#include "server/scenario/urdf_shape_inertias.h"

#include <stdexcept>

#include "server/scenario/urdf_meshes.h"

namespace takt {
namespace {

/// Of density 1.
BodyInertia of_shapes(const UrdfRobot& robot, const UrdfLink& link) {
  BodyInertia sum;
  for (NamedMesh& object : urdf_meshes(robot, link, Pose{})) {
    try {
      (void)make_solid(object);
    } catch (const std::invalid_argument&) {
      continue;  // flat: without volume
    }
    const VolumeProperties solid = volume_properties(object.mesh);
    if (!(solid.volume > 0.0)) continue;
    sum = combined(sum, {solid.volume, solid.p_BBcm, solid.volume * solid.G_BBcm_B}, Pose{});
  }
  return sum;
}

}  // namespace

std::vector<std::optional<BodyInertia>> urdf_shape_inertias(const UrdfArm& arm, double mass_kg) {
  const UrdfRobot& robot = arm.robot;
  std::vector<std::optional<BodyInertia>> result(arm.below_base.size());
  double volume_m3 = 0.0;
  bool missing = false;
  for (std::size_t i = 0; i < result.size(); ++i) {
    const UrdfLink& link = robot.links[arm.below_base[i]];
    if (link.inertial) continue;
    missing = true;
    const BodyInertia shapes = of_shapes(robot, link);
    if (!(shapes.mass_kg > 0.0)) continue;
    volume_m3 += shapes.mass_kg;
    result[i] = shapes;
  }
  if (!missing)
    throw UrdfError(robot.file.string() + ": found <inertial> in each link from '" + arm.base_link +
                    "' on; the robot's key mass_kg is allowed where links have none");
  if (!(volume_m3 > 0.0))
    throw UrdfError(
        robot.file.string() +
        ": found no <collision> or <visual> with a volume in any link without <inertial>; the robot's key "
        "mass_kg needs their shapes");
  const double density_kg_per_m3 = mass_kg / volume_m3;
  for (std::optional<BodyInertia>& inertia : result) {
    if (!inertia) continue;
    inertia->mass_kg *= density_kg_per_m3;
    inertia->I_BBcm_B *= density_kg_per_m3;
  }
  return result;
}

}  // namespace takt
