#pragma once
// Scenarios written back, and what can be written in them.
#include <filesystem>
#include <string>

#include "server/fields/key_info.h"
#include "server/scenario/scenario.h"

namespace takt {

/// YAML text of the scenario, for a file in `directory`: paths are relative to it. Values that are the default are left
/// out. Read again, the text gives a cell of the same model hash. Orientations are degrees, radians or a matrix,
/// whichever gives the same bits. Parts that were deleted by request are unknown to the text: rules that name them are
/// refused when it is read.
std::string write_scenario(const Scenario& scenario, const std::filesystem::path& directory);

/// All sections and keys of a scenario file.
KeyInfo scenario_info();

}  // namespace takt
