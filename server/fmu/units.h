#pragma once
// Conversion between units of FMI and SSP.
#include <map>
#include <optional>
#include <string>

#include "server/devices/fmu_link.h"

namespace takt {

/// The number of the value, which has another unit than `unit`, in that; `units` defines what the value itself does not.
/// std::nullopt: one of the two is not defined, or they are units of different quantities. An angle is a number too.
std::optional<double> in_unit(double number, const FmuRequest::Value& value, const std::string& unit,
                              const std::map<std::string, FmuUnit>& units);

}  // namespace takt
