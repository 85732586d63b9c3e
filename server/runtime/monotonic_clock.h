#pragma once
// The machine's monotonic clock in nanoseconds. An interface only so that the pacer can be tested against a
// clock that the test moves.
#include <cstdint>

namespace takt {

class MonotonicClock {
 public:
  virtual ~MonotonicClock() = default;
  virtual std::int64_t now_ns() = 0;
  /// Returns at or after `deadline_ns`, an absolute time of this clock.
  virtual void sleep_until_ns(std::int64_t deadline_ns) = 0;
};

/// CLOCK_MONOTONIC.
std::int64_t monotonic_now_ns();
MonotonicClock& system_monotonic_clock();

}  // namespace takt
