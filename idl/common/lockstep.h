#pragma once
// Lockstep, as the server and its clients both count it.
#include <cmath>
#include <cstdint>

namespace takt {

/// The step at which period number `k` of a sender with the given period begins: the first step not before k * period.
/// k = 0 is the initial state.
inline std::uint64_t period_boundary_step(std::uint64_t k, double period_s, double step_s) {
  // The small tolerance keeps k * period / step, when it is a whole number, from being rounded up by its last bit.
  return static_cast<std::uint64_t>(std::ceil(static_cast<double>(k) * period_s / step_s - 1e-6));
}

/// Lookahead of a registered controller: the server keeps its commands for the next boundary and so many behind it.
inline constexpr std::uint64_t kMostLookahead = 64;

}  // namespace takt
