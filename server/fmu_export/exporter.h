#pragma once
// A cell as an FMU for co-simulation: a ZIP archive with the scenario and its files, a library that runs it, and the libraries
// that this one needs.
#include <filesystem>
#include <string>
#include <vector>

#include "idl/common/ros_packages.h"
#include "server/scenario/scenario.h"

namespace takt {

struct FmuExportOptions {
  int version = 2;  ///< of FMI: 2 or 3
  std::vector<std::string> inputs,
      outputs;                    ///< names of variables (cell_variables.h); * stands for any characters
  std::filesystem::path library;  ///< libtakt_cell.so
  std::filesystem::path file;     ///< to write
  PackageFolders packages{};  ///< of meshes of robots; such meshes keep their place relative to the URDF file
};

struct FmuExportResult {
  std::vector<std::string> inputs, outputs;
  std::vector<std::string> libraries;  ///< that are in the archive besides the own one
};

/// Throws ScenarioError for a pattern without a variable or a cell that cannot be exported, std::runtime_error for files.
FmuExportResult export_fmu(const Scenario& scenario, const FmuExportOptions& options);

}  // namespace takt
