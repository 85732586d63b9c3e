#include "server/fmu/units.h"

#include <algorithm>

namespace takt {
namespace {

/// Without dimension but for the angle, which is the last of the base units.
bool is_number(const FmuUnit& unit) {
  return std::all_of(unit.exponents.begin(), unit.exponents.end() - 1, [](int e) { return e == 0; });
}

}  // namespace

std::optional<double> in_unit(double number, const FmuRequest::Value& value, const std::string& unit,
                              const std::map<std::string, FmuUnit>& units) {
  const auto source = units.find(value.unit), target = units.find(unit);
  if (target == units.end() || (!value.defined && source == units.end())) return std::nullopt;
  const FmuUnit &from = value.defined ? *value.defined : source->second, &to = target->second;
  if (from.exponents != to.exponents && !(is_number(from) && is_number(to))) return std::nullopt;
  return (from.factor * number + from.offset - to.offset) / to.factor;
}

}  // namespace takt
