#pragma once
// Mesh files (OBJ, STL, GLB) into triangle meshes, by assimp. This is the only place that knows assimp.
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/geometry/mesh/repair.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// The file cannot be used; what() names the file, the place in it where that is known, the fault and what is
/// allowed.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct NamedMesh {
  std::string name;  ///< object or group name in the file, else "object N"
  TriangleMesh mesh;
};

/// All objects of the file, node transforms applied, equal positions of one object merged (STL has no shared
/// vertices), polygons cut into triangles, lengths multiplied by `scale` (> 0). Axes are those of the file:
/// glTF's convention of y up is not turned. Nothing is repaired beyond that. Throws MeshError for a missing,
/// unreadable, truncated or empty file, non-finite or non-numeric coordinates, indices out of range, lines or
/// points, an unsupported format.
///
/// assimp keeps coordinates in single precision. Each is taken as the shortest decimal number that has this
/// single precision value, so that 0.0295 in a file is 0.0295 here and not 0.029500000178814; up to 6 digits
/// are exact.
///
/// Not for two threads at once: assimp has one log for the whole process, and some faults are told only
/// there.
std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale = 1.0);

/// The objects of the file as one mesh; additionally must bound a solid (check_closed), else MeshError says
/// why not. Either every object is closed by itself (a table top and its legs), or all of them together are
/// (a surface cut into groups), in which case equal positions are merged across objects too.
TriangleMesh import_solid(const std::filesystem::path& file, double scale = 1.0);

/// As import_solid, but each object, or all as one surface, is repaired first (repair_mesh). Throws MeshError
/// only for what import_mesh_objects does not read: of a mesh that bounds no solid findings and problem tell.
RepairedMesh import_and_repair(const std::filesystem::path& file, double scale = 1.0);

/// import_and_repair, which must bound a solid, else MeshError as from import_solid.
RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale = 1.0);

}  // namespace takt
