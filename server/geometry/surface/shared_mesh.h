#pragma once
// The mesh of a file and what is made from it. Everything is made at its first use, once, and shared by all
// components that have the mesh.
#include <filesystem>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "server/geometry/mesh/described_mesh.h"
#include "server/geometry/mesh/diagnostic.h"
#include "server/geometry/mesh/import.h"
#include "server/geometry/mesh/repair.h"
#include "server/geometry/mesh/solid_overlap.h"
#include "server/geometry/mesh/triangle_mesh.h"
#include "server/geometry/surface/contact_surface.h"
#include "server/geometry/surface/distance_field.h"
#include "server/geometry/surface/face_octree_cache.h"

namespace takt {

class SharedMesh {
 public:
  /// `repaired` must bound a solid.
  explicit SharedMesh(RepairedMesh repaired, FaceOctreeCache octrees = FaceOctreeCache());

  const TriangleMesh& mesh() const { return repaired_.mesh; }
  /// Of the repair.
  const std::vector<MeshDiagnostic>& findings() const { return repaired_.findings; }
  const VolumeProperties& volume() const { return volume_; }
  const BodyBox& box() const { return box_; }
  double default_element_edge_m() const { return default_element_edge_m_; }

  const std::shared_ptr<const DescribedMesh>& described();
  const std::shared_ptr<const SolidProbe>& probe();
  /// Throws std::invalid_argument as ContactSurface.
  const std::shared_ptr<const ContactSurface>& surface(const ContactSurfaceOptions& options);
  /// Of a result of surface(). Throws std::invalid_argument as DistanceField.
  const std::shared_ptr<const DistanceField>& field(const std::shared_ptr<const ContactSurface>& surface,
                                                    double spacing_m);
  /// check_mesh_quality with these two options; remedies name the component NAME.
  const std::vector<MeshDiagnostic>& quality(double element_edge_m, bool carries_elements);

 private:
  RepairedMesh repaired_;
  FaceOctreeCache octrees_;
  VolumeProperties volume_;
  BodyBox box_;
  double default_element_edge_m_;
  std::shared_ptr<const DescribedMesh> described_;
  std::shared_ptr<const SolidProbe> probe_;
  /// By edge of elements and resampling.
  std::map<std::pair<double, ContactResampling>, std::shared_ptr<const ContactSurface>> surfaces_;
  std::map<std::pair<const ContactSurface*, double>, std::shared_ptr<const DistanceField>> fields_;
  std::map<std::pair<double, bool>, std::vector<MeshDiagnostic>> quality_;
};

/// By component.
using SharedMeshes = std::vector<std::shared_ptr<SharedMesh>>;

/// The meshes of the files of one cell.
class MeshLibrary {
 public:
  explicit MeshLibrary(MeshFiles& files, FaceOctreeCache octrees = FaceOctreeCache())
      : files_(files), octrees_(std::move(octrees)) {}
  /// The file's solid at this scale, repaired; the file is read at the first call. Throws MeshError for a
  /// mesh that bounds no solid.
  const std::shared_ptr<SharedMesh>& mesh(const std::filesystem::path& file, double scale);

 private:
  MeshFiles& files_;
  FaceOctreeCache octrees_;
  std::map<std::pair<std::filesystem::path, double>, std::shared_ptr<SharedMesh>> meshes_;
};

}  // namespace takt
