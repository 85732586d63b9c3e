#pragma once
// Scenarios written back, and the numbers in them.
#include <filesystem>
#include <string>

#include "server/fields/key_info.h"
#include "server/scenario/scenario.h"

namespace takt {

/// YAML text of the scenario, for a file in `directory`: paths are relative to it. Default values are
/// omitted. The text, read again, gives a cell of the same model hash. Orientations are degrees, radians or a
/// matrix, whichever gives the same bits. The text does not contain Parts deleted by request: its rules that
/// name them are refused by the reader.
std::string write_scenario(const Scenario& scenario, const std::filesystem::path& directory);

/// All sections and keys of a scenario file.
KeyInfo scenario_info();

}  // namespace takt
