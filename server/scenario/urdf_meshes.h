#pragma once
// The shapes of a URDF link as triangle meshes.
#include <string>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "server/scenario/urdf_robot.h"

namespace takt {

/// The existing file of a shape of kind mesh. `where` begins the text of the error: "link 'NAME': <collision>: ". Throws
/// UrdfError for a missing file.
std::filesystem::path require_mesh_file(const UrdfRobot& robot, const UrdfShape& shape,
                                        const std::string& where);

/// Throws UrdfError unless all numbers (the sizes of a shape) are positive.
void require_positive(const UrdfRobot& robot, const UrdfShape& shape, const std::string& where,
                      const std::vector<double>& numbers);

/// The <collision> shapes of the link, or the <visual> ones of a link without, in the frame that X_AL places the link in.
/// Boxes are exact; cylinders and spheres have 32 sides, with vertices on the surface. Throws UrdfError for sizes that are
/// not positive and missing mesh files, MeshError for a mesh file that cannot be read.
std::vector<NamedMesh> urdf_meshes(const UrdfRobot& robot, const UrdfLink& link, const Pose& X_AL);

/// The same of these shapes. `where` begins the text of an error: "link 'NAME': <visual>: ".
std::vector<NamedMesh> urdf_meshes(const UrdfRobot& robot, const std::string& name,
                                   const std::vector<UrdfShape>& shapes, const std::string& where,
                                   const Pose& X_AL);

/// Repairs the object. One that bounds no solid becomes its convex hull, and the result says why. Throws
/// std::invalid_argument for one without a hull.
std::string make_solid(NamedMesh& object);

}  // namespace takt
