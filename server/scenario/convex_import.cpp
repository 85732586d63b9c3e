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

std::vector<ConvexShape> hulls_of_objects(const std::filesystem::path& file, double scale) {
  std::vector<ConvexShape> shapes;
  for (const NamedMesh& object : import_mesh_objects(file, scale)) {
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

ConvexImporter::ConvexImporter(const Scenario& scenario, const ImportOptions& options, CellModel& cell)
    : scenario_(scenario), options_(options), cell_(cell), cache_(options.cache_directory) {}

std::vector<ConvexShape> ConvexImporter::shapes(const std::string& component,
                                                const std::filesystem::path& file, double scale,
                                                const TriangleMesh& solid, const ConvexSource& source) {
  const double begin = options_.clock != nullptr ? options_.clock() : 0.0;
  ConvexImport import;
  import.component = component;
  import.method = method_name(source.kind);
  std::vector<ConvexShape> shapes;
  switch (source.kind) {
    case ConvexSource::Kind::hull:
      shapes = {ConvexShape::from_points(convex_hull_vertices(solid.vertices))};
      break;
    case ConvexSource::Kind::objects:
      shapes = hulls_of_objects(file, scale);
      break;
    case ConvexSource::Kind::file:
      shapes = hulls_of_objects(source.file, scale);
      break;
    case ConvexSource::Kind::vhacd:
      try {
        std::function<void(double)> progress;
        if (options_.progress) progress = [&](double part) { options_.progress(component, part); };
        CachedDecomposition parts = decompose_cached(solid, source.decomposition, cache_, progress);
        shapes = std::move(parts.shapes);
        import.from_cache = parts.from_cache;
      } catch (const std::invalid_argument& error) {
        throw ScenarioError(scenario_.file.string() + ": " + component +
                            ": convex: method vhacd: " + error.what());
      }
      break;
  }
  if (options_.clock != nullptr) import.seconds = options_.clock() - begin;
  const VolumeComparison volumes = compare_volumes(solid, shapes);
  import.hulls = static_cast<int>(shapes.size());
  import.lost = volumes.lost;
  import.gained = volumes.gained;
  import.solid_volume_m3 = volumes.solid_volume;
  import.union_volume_m3 = volumes.union_volume;
  note(import, source, source.max_volume_error.value_or(scenario_.max_volume_error));
  cell_.convex_imports.push_back(std::move(import));
  return shapes;
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
                  " convex, and is none missing?";
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
