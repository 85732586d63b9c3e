#pragma once
// Systems of FMUs: SystemStructure.ssd of an unpacked SSP (System Structure and Parameterization, 1.0), with systems in it
// dissolved. What takt does not do is refused with its line.
#include <filesystem>

#include "server/devices/fmu_link.h"

namespace takt {

/// `directory`: where the SSP was unpacked to. Throws FmuError.
FmuSystem read_ssp(const std::filesystem::path& directory);

}  // namespace takt
