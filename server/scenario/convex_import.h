#pragma once
// The convex shapes of a component's mesh for the collision check, and their deviation from its solid.
#include <filesystem>
#include <string>
#include <vector>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/geometry/convex/overlap.h"
#include "server/scenario/scenario.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

class ConvexImporter {
 public:
  /// Figures and notes go into the cell.
  ConvexImporter(const Scenario& scenario, const ImportOptions& options, CellModel& cell);

  /// The shapes as the source states, never empty. `solid` is the mesh of `file`, lengths multiplied by
  /// `scale`. Adds a ConvexImport, and an ImportNote if the lost or gained volume exceeds the limit. Throws
  /// ScenarioError with the component's name if the source yields no shapes, MeshError for a file.
  std::vector<ConvexShape> shapes(const std::string& component, const std::filesystem::path& file,
                                  double scale, const TriangleMesh& solid, const ConvexSource& source);

 private:
  void note(const ConvexImport& import, const ConvexSource& source, double allowed);

  const Scenario& scenario_;
  const ImportOptions& options_;
  CellModel& cell_;
  DecompositionCache cache_;
};

}  // namespace takt
