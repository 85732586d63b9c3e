#pragma once
// The convex shapes that a component's mesh gets for the collision check, and how far they are from its
// solid.
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

  /// The shapes as the source says, never empty. `solid` is the mesh of `file`, lengths multiplied by
  /// `scale`. Adds a ConvexImport, and an ImportNote if more of the volume is lost or gained than is allowed.
  /// Throws ScenarioError naming the component if the source yields no shapes, MeshError for a file.
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
