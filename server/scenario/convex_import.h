#pragma once
// The convex shapes of a component's mesh for the collision check, and their deviation from its solid.
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/geometry/convex/convex_parts.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/geometry/surface/shared_mesh.h"
#include "server/scenario/scenario.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

class ConvexImporter {
 public:
  /// Figures and notes go into the cell.
  ConvexImporter(const Scenario& scenario, const ImportOptions& options, MeshFiles& files, CellModel& cell);

  /// The shapes as the source states, never empty. `solid` is the mesh of `file`, lengths multiplied by
  /// `scale`. Components of one mesh and one source share their shapes. Adds a ConvexImport, and an ImportNote
  /// if the lost or gained volume exceeds the limit. Throws ScenarioError with the component's name if the
  /// source yields no shapes, MeshError for a file.
  ConvexParts parts(const std::string& component, const std::filesystem::path& file, double scale,
                    const std::shared_ptr<SharedMesh>& solid, const ConvexSource& source);

 private:
  struct Made {
    std::shared_ptr<SharedMesh> solid;
    ConvexSource source;
    ConvexParts parts;
    ConvexImport import;
    bool is_of(const std::shared_ptr<SharedMesh>& mesh, const ConvexSource& stated) const;
  };
  const Made& made(const std::string& component, const std::filesystem::path& file, double scale,
                   const std::shared_ptr<SharedMesh>& solid, const ConvexSource& source);
  std::vector<ConvexShape> shapes(const std::string& component, const std::filesystem::path& file,
                                  double scale, const TriangleMesh& solid, const ConvexSource& source,
                                  ConvexImport& import);
  void note(const ConvexImport& import, const ConvexSource& source, double allowed);

  const Scenario& scenario_;
  const ImportOptions& options_;
  MeshFiles& files_;
  CellModel& cell_;
  DecompositionCache cache_;
  std::map<const SharedMesh*, std::vector<Made>> made_;
};

}  // namespace takt
