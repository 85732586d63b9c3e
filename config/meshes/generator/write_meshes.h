#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

/// Writes NAME.obj with these objects. Throws std::runtime_error if it cannot be written.
void write_solids(const std::filesystem::path& directory, const std::string& name, const std::string& what,
                  const std::vector<Solid>& solids);

}  // namespace takt::meshes
