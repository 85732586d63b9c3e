#pragma once
// Times as messages carry them: seconds and nanoseconds, from and to a number of nanoseconds or of seconds.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ros2_msgs.h"

namespace takt {

inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

/// Floor of the seconds, so that the nanoseconds are 0 to 999999999 for negative times too.
constexpr builtin_interfaces::msg::Time to_stamp(std::int64_t ns) {
  const std::int64_t rest = (ns % kNanosecondsPerSecond + kNanosecondsPerSecond) % kNanosecondsPerSecond;
  return {static_cast<std::int32_t>((ns - rest) / kNanosecondsPerSecond), static_cast<std::uint32_t>(rest)};
}
constexpr std::int64_t nanoseconds_of(const builtin_interfaces::msg::Time& stamp) {
  return stamp.sec * kNanosecondsPerSecond + stamp.nanosec;
}

/// To the nearest nanosecond.
inline std::int64_t to_nanoseconds(double time_s) {
  return std::llround(time_s * 1e9);
}
/// Simulated time: never negative.
inline builtin_interfaces::msg::Time to_time(double time_s) {
  return to_stamp(to_nanoseconds(std::max(time_s, 0.0)));
}
/// The nearest double, so that 300 ms are 0.3 s.
inline double seconds_of(const builtin_interfaces::msg::Time& stamp) {
  return static_cast<double>(nanoseconds_of(stamp)) / 1e9;
}

}  // namespace takt
