#pragma once
// Permitted names of parts, grounds, robots, grippers and devices: they become levels of DDS topics and keys
// of reports.
#include <algorithm>
#include <cstddef>
#include <string_view>

namespace takt {

inline constexpr std::size_t kLongestScenarioName = 64;
inline constexpr const char* kAllowedScenarioNames =
    "a letter, then letters, digits and underscores, at most 64";

inline bool is_scenario_name(std::string_view name) {
  const auto letter = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); };
  const auto fits = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; };
  return !name.empty() && name.size() <= kLongestScenarioName && letter(name.front()) &&
         std::all_of(name.begin(), name.end(), fits);
}

}  // namespace takt
