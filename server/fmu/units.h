#pragma once
// Conversion between units of FMI and SSP.
#include <optional>

#include "server/devices/fmu_link.h"

namespace takt {

/// A value in `from` as one in `to`. std::nullopt: they are units of different quantities. An angle is a number too.
std::optional<double> in_unit(double value, const FmuUnit& from, const FmuUnit& to);

}  // namespace takt
