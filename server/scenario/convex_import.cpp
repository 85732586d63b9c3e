#include "server/scenario/convex_import.h"

#include <sstream>
#include <stdexcept>

#include "server/geometry/convex/volume_comparison.h"
#include "server/geometry/mesh/import.h"

namespace takt {

namespace {

const char* method_name(ConvexSource::Kind kind) {
  switch (kind) {
    case ConvexSource::Kind::objects:
      return "objects";
    case ConvexSource::Kind::file:
      return "file";
    case ConvexSource::Kind::vhacd:
      return "vhacd";
    case ConvexSource::Kind::hull:
      break;
  }
  return "hull";
}

std::vector<ConvexShape> hulls_of_objects(const std::filesystem::path& file, double scale, MeshFiles& files) {
  std::vector<ConvexShape> shapes;
  for (const NamedMesh& object : import_mesh_objects(file, scale, files)) {
    try {
      shapes.push_back(ConvexShape::from_points(convex_hull_vertices(object.mesh.vertices)));
    } catch (const std::invalid_argument& error) {
      throw MeshError("mesh file " + file.string() + ": object '" + object.name +
                      "' cannot be a convex part: " + error.what());
    }
  }
  return shapes;
}

std::string percent(double share) {
  std::ostringstream text;
  text.precision(share < 0.1 ? 2 : 3);
  text << 100.0 * share << " %";
  return text.str();
}

}  // namespace

ConvexImporter::ConvexImporter(const Scenario& scenario, const ImportOptions& options, MeshFiles& files,
                               CellModel& cell)
    : scenario_(scenario), options_(options), files_(files), cell_(cell), cache_(options.cache_directory) {}

std::vector<ConvexShape> ConvexImporter::shapes(const std::string& component,
                                                const std::filesystem::path& file, double scale,
                                                const TriangleMesh& solid, const ConvexSource& source,
                                                ConvexImport& import) {
  switch (source.kind) {
    case ConvexSource::Kind::hull:
      break;
    case ConvexSource::Kind::objects:
      return hulls_of_objects(file, scale, files_);
    case ConvexSource::Kind::file:
      return hulls_of_objects(source.file, scale, files_);
    case ConvexSource::Kind::vhacd:
      try {
        std::function<void(double)> progress;
        if (options_.progress) progress = [&](double part) { options_.progress(component, part); };
        CachedDecomposition parts = decompose_cached(solid, source.decomposition, cache_, progress);
        import.from_cache = parts.from_cache;
        return std::move(parts.shapes);
      } catch (const std::invalid_argument& error) {
        throw ScenarioError(scenario_.file.string() + ": " + component +
                            ": convex: method vhacd: " + error.what());
      }
  }
  return {ConvexShape::from_points(convex_hull_vertices(solid.vertices))};
}

bool ConvexImporter::Made::is_of(const std::shared_ptr<SharedMesh>& mesh, const ConvexSource& stated) const {
  return mesh == solid && stated.kind == source.kind && stated.file == source.file &&
         stated.decomposition == source.decomposition;
}

const ConvexImporter::Made& ConvexImporter::made(const std::string& component,
                                                 const std::filesystem::path& file, double scale,
                                                 const std::shared_ptr<SharedMesh>& solid,
                                                 const ConvexSource& source) {
  std::vector<Made>& known = made_[solid.get()];
  for (Made& one : known) {
    if (!one.is_of(solid, source)) continue;
    one.import.seconds = 0.0;
    return one;
  }
  const double begin = options_.clock != nullptr ? options_.clock() : 0.0;
  Made made{solid, source, {}, {}};
  ConvexImport& import = made.import;
  import.method = method_name(source.kind);
  made.parts = shapes(component, file, scale, solid->mesh(), source, import);
  if (options_.clock != nullptr) import.seconds = options_.clock() - begin;
  const VolumeComparison volumes = source.kind == ConvexSource::Kind::hull
                                       ? compare_with_hull(solid->mesh(), made.parts[0])
                                       : compare_volumes(solid->mesh(), made.parts.shapes());
  import.hulls = static_cast<int>(made.parts.size());
  import.lost = volumes.lost;
  import.gained = volumes.gained;
  import.solid_volume_m3 = volumes.solid_volume;
  import.union_volume_m3 = volumes.union_volume;
  known.push_back(std::move(made));
  return known.back();
}

ConvexParts ConvexImporter::parts(const std::string& component, const std::filesystem::path& file,
                                  double scale, const std::shared_ptr<SharedMesh>& solid,
                                  const ConvexSource& source) {
  const Made& found = made(component, file, scale, solid, source);
  ConvexImport import = found.import;
  import.component = component;
  note(import, source, source.max_volume_error.value_or(scenario_.max_volume_error));
  cell_.convex_imports.push_back(std::move(import));
  return found.parts;
}

void ConvexImporter::note(const ConvexImport& import, const ConvexSource& source, double allowed) {
  const double error = import.lost + import.gained;
  if (error <= allowed) return;
  std::string sentence = import.component + ": for the collision check ";
  if (source.kind == ConvexSource::Kind::hull)
    sentence += "its convex hull stands for it, which gains " + percent(import.gained) + " of its volume";
  else
    sentence += "it is " + std::to_string(import.hulls) +
                (import.hulls == 1 ? " convex part (" : " convex parts (") + import.method + "), by which " +
                percent(import.lost) + " of its volume is lost and " + percent(import.gained) + " gained";
  sentence += "; more than " + percent(allowed) + " is reported (max_volume_error). ";
  switch (source.kind) {
    case ConvexSource::Kind::hull:
      sentence += "With `convex: vhacd` its pockets stay open.";
      break;
    case ConvexSource::Kind::objects:
    case ConvexSource::Kind::file:
      sentence += "Is each object of " +
                  (source.kind == ConvexSource::Kind::file ? source.file.filename().string() : "its mesh") +
                  " convex, and are all objects present?";
      break;
    case ConvexSource::Kind::vhacd:
      sentence += "More max_hulls (now " + std::to_string(source.decomposition.max_hulls) +
                  ") or a higher resolution (now " + std::to_string(source.decomposition.resolution) +
                  ") come closer.";
      break;
  }
  cell_.import_notes.push_back({import.component, sentence, ImportNote::Shapes{import.hulls, error}});
}

}  // namespace takt
