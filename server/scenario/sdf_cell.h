#pragma once
// A world of SDFormat as a scenario: static models and what is fixed to the world become Grounds, free rigid bodies
// Parts, models with revolute and prismatic joints robots with a URDF each.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/mesh/builder.h"
#include "server/scenario/scenario.h"
#include "server/scenario/sdf_world.h"

namespace takt {

/// The scenario, whose paths are in the directory, and the files that it names there.
struct SdfCell {
  Scenario scenario;
  std::vector<std::pair<std::filesystem::path, std::vector<NamedMesh>>> meshes;  ///< to be written as OBJ
  std::vector<std::pair<std::filesystem::path, std::string>> urdfs;
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> copies;  ///< copy, original
  std::vector<std::string> notes;  ///< what is left out or assumed, whole sentences
};

/// A Part has the shapes of <collision>, of a link without them those of <visual>, in the frame of its first link. Meshes
/// that enclose no volume are replaced by their convex hulls. A Part lies in those that begin below it (hierarchy). The
/// base of a robot is the link that no joint carries; its flange the last link before its joints branch.
SdfCell sdf_cell(const SdfWorld& world, const std::filesystem::path& directory);

}  // namespace takt
