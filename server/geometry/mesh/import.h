#pragma once
// Imports mesh files (OBJ, STL, GLB) as triangle meshes. The readers of the formats list the supported
// content.
#include <filesystem>
#include <map>
#include <memory>
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

class GlbFile;

/// The GLB files of a load, each read and understood once, whatever the number of its nodes that are asked for.
class MeshFiles {
 public:
  MeshFiles();
  ~MeshFiles();
  /// Throws MeshError, MeshFault.
  const GlbFile& glb(const std::filesystem::path& file);
  /// Objects that no file has, by a name that is used in place of a file.
  void add(const std::filesystem::path& name, std::vector<NamedMesh> objects);
  /// Null: the name is that of a file.
  const std::vector<NamedMesh>* added(const std::filesystem::path& name) const;

 private:
  std::map<std::filesystem::path, std::unique_ptr<const GlbFile>> glb_;
  std::map<std::filesystem::path, std::vector<NamedMesh>> added_;
};

/// All objects of the file that have faces (of FILE.glb#NODE those of the node, in its frame: GlbFile),
/// lengths multiplied by `scale` (> 0). Coordinates in text have double precision. Positions that are equal in
/// single precision become one vertex of an object, at the place of the first. The mesh is not repaired further.
/// Throws MeshError for a missing, unreadable, truncated or empty file, coordinates that are not finite in single
/// precision, indices out of range, or an unsupported format. Lines and points of OBJ files are passed over (findings).
std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale, MeshFiles& files);
std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale = 1.0);

/// A node of a GLB file that has faces, or has nodes with faces below it.
struct MeshNode {
  std::string path;        ///< names from the root to it, e.g. Cell/Frame/Housing
  bool has_faces = false;  ///< of its own
  Pose X_FN;               ///< in the file, y up; lengths multiplied by the scale
};

/// A pose in a file whose y axis points up, in the same file with z up: (x, y, z) becomes (x, -z, y).
Pose upright(const Pose& X_FN);

/// The nodes of a GLB file, or of FILE.glb#NODE that one first and those below it, parents before children;
/// none of other formats. Throws MeshError.
std::vector<MeshNode> list_mesh_nodes(const std::filesystem::path& file, double scale, MeshFiles& files);
std::vector<MeshNode> list_mesh_nodes(const std::filesystem::path& file, double scale = 1.0);

/// The objects of the file as one mesh that bounds a solid (check_closed); else throws MeshError with the
/// reason. Either every object is closed by itself (a table top and its legs), or all of them together are (a
/// surface cut into groups); in the second case the positions of all objects are merged.
TriangleMesh import_solid(const std::filesystem::path& file, double scale = 1.0);

/// As import_solid, but first repairs each object; those that stay open are joined at equal positions and
/// repaired as one surface, without the closed ones, or else with them (repair_mesh). Throws MeshError only
/// as import_mesh_objects; for a mesh that bounds no solid the result has findings and a problem.
RepairedMesh import_and_repair(const std::filesystem::path& file, double scale, MeshFiles& files);
RepairedMesh import_and_repair(const std::filesystem::path& file, double scale = 1.0);

/// As import_and_repair; throws MeshError as import_solid if the repaired mesh bounds no solid.
RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale, MeshFiles& files);
RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale = 1.0);

}  // namespace takt
