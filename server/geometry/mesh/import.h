#pragma once
// Imports mesh files (OBJ, STL, GLB) as triangle meshes. The readers of the formats list the supported
// content.
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/geometry/mesh/builder.h"
#include "server/geometry/mesh/repair.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// The file is unusable; what() names the file, the place in it if known, the fault and the values allowed.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// All objects of the file that have faces, lengths multiplied by `scale` (> 0). Coordinates in text have
/// double precision. Positions that are equal in single precision become one vertex of an object, at the
/// place of the first. The mesh is not repaired further. Throws MeshError for a missing, unreadable,
/// truncated or empty file, coordinates that are not finite in single precision, indices out of range, or an
/// unsupported format. Lines and points of OBJ files are passed over (NamedMesh::findings).
std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale = 1.0);

/// The objects of the file as one mesh that bounds a solid (check_closed); else throws MeshError with the
/// reason. Either every object is closed by itself (a table top and its legs), or all of them together are (a
/// surface cut into groups); in the second case the positions of all objects are merged.
TriangleMesh import_solid(const std::filesystem::path& file, double scale = 1.0);

/// As import_solid, but first repairs each object; those that stay open are joined at equal positions and
/// repaired as one surface, without the closed ones, or else with them (repair_mesh). Throws MeshError only
/// as import_mesh_objects; for a mesh that bounds no solid the result has findings and a problem.
RepairedMesh import_and_repair(const std::filesystem::path& file, double scale = 1.0);

/// As import_and_repair; throws MeshError as import_solid if the repaired mesh bounds no solid.
RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale = 1.0);

}  // namespace takt
