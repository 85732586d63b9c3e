#pragma once
// Mesh files (OBJ, STL, GLB) into triangle meshes: what of a file is read say the readers of the formats.
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/geometry/mesh/builder.h"
#include "server/geometry/mesh/repair.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// The file cannot be used; what() names the file, the place in it where that is known, the fault and what is
/// allowed.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// All objects of the file that have faces, lengths multiplied by `scale` (> 0). Coordinates of a text are in double
/// precision. Positions that are equal in single precision are one vertex of an object, at the place of the first.
/// Nothing is repaired beyond that. Throws MeshError for a missing, unreadable, truncated or empty file, coordinates
/// that are not finite in single precision, indices out of range, lines or points, an unsupported format.
std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale = 1.0);

/// The objects of the file as one mesh; additionally must bound a solid (check_closed), else MeshError says
/// why not. Either every object is closed by itself (a table top and its legs), or all of them together are
/// (a surface cut into groups), in which case the positions of all objects are merged so.
TriangleMesh import_solid(const std::filesystem::path& file, double scale = 1.0);

/// As import_solid, but each object, or all as one surface, is repaired first (repair_mesh). Throws MeshError
/// only for what import_mesh_objects does not read: of a mesh that bounds no solid findings and problem tell.
RepairedMesh import_and_repair(const std::filesystem::path& file, double scale = 1.0);

/// import_and_repair, which must bound a solid, else MeshError as from import_solid.
RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale = 1.0);

}  // namespace takt
