#pragma once
// Mesh files (OBJ, STL, GLB) into triangle meshes, by assimp. This is the only place that knows assimp.
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/geometry/triangle_mesh.h"

namespace takt {

/// The file cannot be used; what() names the file, the place in it where that is known, the fault and what is allowed.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct NamedMesh {
  std::string name;  ///< object or group name in the file
  TriangleMesh mesh;
};

/// All objects of the file, node transforms applied, equal positions merged (STL has no shared vertices), lengths
/// multiplied by `scale`. Nothing is repaired beyond that. Throws MeshError for a missing, unreadable or empty file,
/// non-finite coordinates, an unsupported format.
std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale = 1.0);

/// The objects of the file as one mesh; additionally must bound a solid (check_closed), else MeshError says why not.
TriangleMesh import_solid(const std::filesystem::path& file, double scale = 1.0);

}  // namespace takt
