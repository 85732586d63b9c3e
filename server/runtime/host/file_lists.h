#pragma once
// Files that clients may ask for, in the lists of get_scenarios and get_spawnables: searched below directories, without
// those that links lead to. A server with a directory of scenarios lists nothing outside of it (allowed_files.h).
#include <filesystem>
#include <vector>

#include "server/runtime/requests/control.h"
#include "server/scenario/scenario.h"

namespace takt {

/// One of these, e.g. yaml; capital letters count as small ones.
bool has_extension(const std::filesystem::path& file, const std::vector<std::string>& extensions);

/// `directory`: of the server's scenarios; empty: none, and the files beside `loaded` are listed, if there is one.
Outcome<requests::GetScenarios> list_scenarios(const requests::GetScenarios& request,
                                               const std::filesystem::path& directory,
                                               const std::filesystem::path& loaded);

/// Parts of the loaded scenario, and mesh files of the sources. `content`: nullptr if it came from no file.
Outcome<requests::GetSpawnables> list_spawnables(const requests::GetSpawnables& request,
                                                 const std::filesystem::path& directory,
                                                 const Scenario* content, const CellDescription& cell);

}  // namespace takt
