#pragma once
// Finds the intended name for a mistyped one.
#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace takt {

/// Number of letters to insert, remove or exchange between two texts (Levenshtein distance).
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t exchanged = diagonal + (a[i] == b[j] ? 0U : 1U);
      diagonal = row[j + 1];
      row[j + 1] = std::min({exchanged, row[j] + 1, diagonal + 1});
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
