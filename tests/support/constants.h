#pragma once
// Numbers that many tests use.
#include <cstdint>

namespace takt::test {

inline constexpr double kQuarterTurn_rad = 1.5707963267948966;
inline constexpr double kGravity_m_s2 = 9.80665;
inline constexpr std::int64_t kMillisecond_ns = 1'000'000;

}  // namespace takt::test
