#pragma once
// Numbers 0 .. n-1 in sets that are joined pairwise. Only the constructor allocates.
#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "idl/common/text.h"

namespace takt {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { reset(); }
  /// Each number alone.
  void reset() { std::iota(parent_.begin(), parent_.end(), 0U); }
  /// The lowest member of the set of i.
  template <std::integral Index>
  Index root(Index i) {
    auto at = static_cast<std::uint32_t>(i);
    while (parent_[at] != at) at = parent_[at] = parent_[parent_[at]];
    return static_cast<Index>(at);
  }
  template <std::integral Index>
  void join(Index a, Index b) {
    a = root(a), b = root(b);
    parent_[static_cast<std::size_t>(std::max(a, b))] = static_cast<std::uint32_t>(std::min(a, b));
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace takt
