#pragma once
// Simulated time as a stamp: whole nanoseconds since the initial state, as on the wire. Stamps are stored, compared,
// recorded and published in this form. Seconds are for physics and for text.
#include <cmath>
#include <compare>
#include <cstdint>

namespace takt {

struct SimTime {
  std::int64_t ns = -1;  ///< negative: no stamp

  /// The nearest nanosecond; no stamp for a negative time. At most 9.2e9 s.
  static SimTime from_seconds(double time_s) { return {time_s < 0.0 ? -1 : std::llround(time_s * 1e9)}; }

  bool given() const { return ns >= 0; }
  /// The double nearest to the stamp, so that 300 ms are 0.3 s; -1 without a stamp.
  double seconds() const { return given() ? static_cast<double>(ns) / 1e9 : -1.0; }
  friend bool operator==(const SimTime&, const SimTime&) = default;
  friend auto operator<=>(const SimTime& a, const SimTime& b) { return a.ns <=> b.ns; }
};

}  // namespace takt
