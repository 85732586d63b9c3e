#pragma once
// A Scenario into a CellModel: reads meshes and robots, derives masses, convex shapes, spring constants and
// pairs.
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "idl/common/ros_packages.h"
#include "server/scenario/scenario.h"
#include "server/scenario/scenario_reader.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Options of the import of meshes; the result does not depend on them.
struct ImportOptions {
  std::filesystem::path cache_directory;  ///< of what is made from meshes; empty: without cache
  double (*clock)() = nullptr;            ///< seconds, for the times in CellModel::convex_imports
  /// Called during long work (a decomposition that is not in the cache): component, and the finished share,
  /// from 0 to 1.
  std::function<void(const std::string&, double)> progress{};
  FmuOpener* fmus = nullptr;  ///< none: scenarios with FMUs are refused
  PackageFolders packages{};  ///< where package://PACKAGE/PATH in URDF files is searched
};

/// Throws ScenarioError (naming the scenario's key), MeshError or UrdfError (naming file and place).
std::shared_ptr<const CellModel> build_cell(const Scenario& scenario, const ImportOptions& import = {});

/// read_scenario and build_cell in one.
std::shared_ptr<const CellModel> load_cell(const std::filesystem::path& file,
                                           const ScenarioOptions& options = {},
                                           const ImportOptions& import = {});

}  // namespace takt
