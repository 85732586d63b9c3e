#include "server/fmu/units.h"

#include <algorithm>

namespace takt {
namespace {

/// Without dimension but for the angle, which is the last of the base units.
bool is_number(const FmuUnit& unit) {
  return std::all_of(unit.exponents.begin(), unit.exponents.end() - 1, [](int e) { return e == 0; });
}

}  // namespace

std::optional<double> in_unit(double value, const FmuUnit& from, const FmuUnit& to) {
  if (from.exponents != to.exponents && !(is_number(from) && is_number(to))) return std::nullopt;
  return (from.factor * value + from.offset - to.offset) / to.factor;
}

}  // namespace takt
