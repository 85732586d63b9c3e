#pragma once
// Finds the intended name for a mistyped one.
#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace takt {

/// Number of letters to insert, remove or replace and of neighbours to swap between two texts (optimal string alignment
/// distance: no letter is edited twice).
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(above);
    above.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({above[j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U), row[j - 1] + 1, above[j] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row.back();
}

/// " Did you mean 'NAME'?" for the nearest of `names` that differs from `name` in at most a third of its
/// letters; else an empty text.
template <typename Names>
std::string did_you_mean(std::string_view name, const Names& names) {
  constexpr std::size_t kLongest = 128;
  std::string_view nearest;
  std::size_t least = std::min(name.size(), kLongest) / 3;
  if (name.size() > kLongest) return {};
  for (const std::string_view one : names) {
    if (one.size() > kLongest) continue;
    const std::size_t distance = edit_distance(name, one);
    if (distance > least || distance == 0) continue;
    if (!nearest.empty() && distance == least) continue;
    least = distance;
    nearest = one;
  }
  return nearest.empty() ? std::string() : " Did you mean '" + std::string(nearest) + "'?";
}

}  // namespace takt
