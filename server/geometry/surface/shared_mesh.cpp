#include "server/geometry/surface/shared_mesh.h"

#include "server/geometry/mesh/quality.h"

namespace takt {

namespace {

BodyBox box_of(const TriangleMesh& mesh) {
  const auto [lower, upper] = bounds_of(mesh);
  return {0.5 * (lower + upper), 0.5 * (upper - lower)};
}

}  // namespace

SharedMesh::SharedMesh(RepairedMesh repaired, FaceOctreeCache octrees)
    : repaired_(std::move(repaired)),
      octrees_(std::move(octrees)),
      volume_(volume_properties(repaired_.mesh)),
      box_(box_of(repaired_.mesh)),
      default_element_edge_m_(takt::default_element_edge_m(repaired_.mesh)) {}

const std::shared_ptr<const DescribedMesh>& SharedMesh::described() {
  if (described_ != nullptr) return described_;
  auto described = std::make_shared<DescribedMesh>();
  described->vertices.reserve(3 * mesh().vertices.size());
  for (const Vec3& v : mesh().vertices)
    for (int i = 0; i < 3; ++i) described->vertices.push_back(static_cast<float>(v[i]));
  described->triangles.reserve(3 * mesh().triangles.size());
  for (const auto& t : mesh().triangles)
    described->triangles.insert(described->triangles.end(), t.begin(), t.end());
  described_ = std::move(described);
  return described_;
}

const std::shared_ptr<const SolidProbe>& SharedMesh::probe() {
  if (probe_ == nullptr) probe_ = std::make_shared<const SolidProbe>(mesh());
  return probe_;
}

const std::shared_ptr<const ContactSurface>& SharedMesh::surface(const ContactSurfaceOptions& options) {
  std::shared_ptr<const ContactSurface>& surface = surfaces_[{options.element_edge_m, options.resampling}];
  if (surface == nullptr) surface = std::make_shared<const ContactSurface>(mesh(), options, &octrees_);
  return surface;
}

const std::shared_ptr<const DistanceField>& SharedMesh::field(
    const std::shared_ptr<const ContactSurface>& surface, double spacing_m) {
  std::shared_ptr<const DistanceField>& field = fields_[{surface.get(), spacing_m}];
  if (field == nullptr) field = std::make_shared<const DistanceField>(surface, spacing_m);
  return field;
}

const std::vector<MeshDiagnostic>& SharedMesh::quality(double element_edge_m, bool carries_elements) {
  const auto [place, is_new] = quality_.try_emplace({element_edge_m, carries_elements});
  if (is_new) {
    MeshQualityOptions options;
    options.element_edge_m = element_edge_m;
    options.carries_elements = carries_elements;
    place->second = check_mesh_quality(mesh(), options);
  }
  return place->second;
}

const std::shared_ptr<SharedMesh>& MeshLibrary::mesh(const std::filesystem::path& file, double scale) {
  const auto [place, is_new] = meshes_.try_emplace({file, scale});
  if (!is_new && place->second != nullptr) return place->second;
  place->second = std::make_shared<SharedMesh>(import_repaired_solid(file, scale, files_), octrees_);
  return place->second;
}

}  // namespace takt
