#pragma once
// A Scenario into a CellModel: reads meshes and robots, derives masses, convex shapes, spring constants and
// pairs.
#include <filesystem>
#include <memory>

#include "server/scenario/scenario.h"
#include "server/scenario/scenario_reader.h"
#include "server/simulation/cell_model.h"

namespace takt {

/// Throws ScenarioError (naming the scenario's key), MeshError or UrdfError (naming file and place).
std::shared_ptr<const CellModel> build_cell(const Scenario& scenario);

/// read_scenario and build_cell in one.
std::shared_ptr<const CellModel> load_cell(const std::filesystem::path& file,
                                           const ScenarioOptions& options = {});

}  // namespace takt
