#pragma once
// The signals that every device of a kind has. Each kind states them in one table: its devices are built from it, and
// docs/signals.md is written from it (takt-run reference signals). A signal without an explanation does not compile.
#include <initializer_list>
#include <span>
#include <vector>

#include "server/simulation/model/cell_description.h"

namespace takt {

struct KindSignal {
  const char* name;
  const char* unit;
  bool commanded;
  double lower, upper;
  SignalType type;
  const char* limits;  ///< in words, where each device has its own; else empty
  const char* doc;     ///< one sentence without a point, or several; no empty text

  bool has_own_limits() const { return *limits != '\0'; }
};

struct SignalLimits {
  double lower, upper;
};

/// The signals of one device. `own` are the limits of those signals whose limits differ between devices, in their order.
std::vector<SignalDescription> described(std::span<const KindSignal> signals,
                                         std::initializer_list<SignalLimits> own = {});

consteval KindSignal explained(KindSignal signal) {
  if (*signal.doc == '\0') throw "a signal needs an explanation";
  return signal;
}

/// A signal that is reported, and cannot be commanded.
consteval KindSignal reported(const char* name, const char* unit, const char* doc) {
  return explained({name, unit, false, 0.0, 0.0, SignalType::real, "", doc});
}
/// A reported signal that is 0 or 1.
consteval KindSignal reported_flag(const char* name, const char* doc) {
  return explained({name, "", false, 0.0, 0.0, SignalType::boolean, "", doc});
}
/// A reported signal that is a whole number.
consteval KindSignal reported_count(const char* name, const char* doc) {
  return explained({name, "", false, 0.0, 0.0, SignalType::integer, "", doc});
}
/// A signal that clients may set, within its limits.
consteval KindSignal commanded(const char* name, const char* unit, double lower, double upper,
                               const char* doc) {
  return explained({name, unit, true, lower, upper, SignalType::real, "", doc});
}
/// The same with limits that each device has its own; `limits` says them in words.
consteval KindSignal commanded(const char* name, const char* unit, const char* limits, const char* doc) {
  return explained({name, unit, true, 0.0, 0.0, SignalType::real, limits, doc});
}
/// A signal that clients may set to 0 or 1.
consteval KindSignal commanded_flag(const char* name, const char* doc) {
  return explained({name, "", true, 0.0, 1.0, SignalType::boolean, "", doc});
}

}  // namespace takt
