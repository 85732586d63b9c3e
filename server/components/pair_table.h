#pragma once
// Pairs (base, target) of components, ordered by base, then target. A pair's number is its place in this order.
// Four bytes a pair: a cell of 3000 Parts has 4.5 million of them.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace takt {

/// Of two components (ids), in either order the same.
using PairPredicate = std::function<bool(int, int)>;

class PairTable {
 public:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// In ascending order.
  void add(int base, int target) {
    while (rows_.size() <= static_cast<std::size_t>(base)) rows_.push_back(targets_.size());
    targets_.push_back(target);
  }
  void shrink_to_fit() { targets_.shrink_to_fit(); }

  std::size_t size() const { return targets_.size(); }
  int target(std::size_t pair) const { return targets_[pair]; }
  int base(std::size_t pair) const {
    return static_cast<int>(std::upper_bound(rows_.begin(), rows_.end(), pair) - rows_.begin()) - 1;
  }
  /// Numbers of the pairs of a base: from begin_of() up to, but not including, end_of().
  std::size_t begin_of(int base) const {
    const auto row = static_cast<std::size_t>(base);
    return row < rows_.size() ? rows_[row] : targets_.size();
  }
  std::size_t end_of(int base) const { return begin_of(base + 1); }
  /// Bases are below this.
  int base_count() const { return static_cast<int>(rows_.size()); }
  /// Number of the pair, or kNone.
  std::size_t find(int base, int target) const {
    const auto at = [this](std::size_t i) { return targets_.begin() + static_cast<std::ptrdiff_t>(i); };
    const auto end = at(end_of(base));
    const auto found = std::lower_bound(at(begin_of(base)), end, target);
    return found != end && *found == target ? static_cast<std::size_t>(found - targets_.begin()) : kNone;
  }
  /// The same for two components in either order.
  std::size_t find_either(int a, int b) const {
    const std::size_t found = find(a, b);
    return found != kNone ? found : find(b, a);
  }

 private:
  std::vector<std::size_t> rows_;  ///< by base: number of its first pair
  std::vector<std::int32_t> targets_;
};

/// Iterates over a table whose pairs are made when they are asked for.
template <class Table>
class PairIterator {
 public:
  PairIterator(const Table& table, std::size_t pair) : table_(&table), pair_(pair) {}
  auto operator*() const { return (*table_)[pair_]; }
  PairIterator& operator++() {
    ++pair_;
    return *this;
  }
  bool operator==(const PairIterator&) const = default;

 private:
  const Table* table_;
  std::size_t pair_;
};

}  // namespace takt
