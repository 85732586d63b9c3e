#include "server/simulation/solver/sparse_lu.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace takt {

namespace {
constexpr double kTinyPivot = 1e-13;

// Order of elimination by smallest degree on the symmetric pattern.
std::vector<int> smallest_degree_order(std::vector<std::set<int>> neighbours) {
  std::set<std::pair<std::size_t, int>> queue;
  for (std::size_t i = 0; i < neighbours.size(); ++i)
    queue.emplace(neighbours[i].size(), static_cast<int>(i));
  std::vector<int> order;
  while (!queue.empty()) {
    const int next = queue.begin()->second;
    queue.erase(queue.begin());
    order.push_back(next);
    const std::set<int> around = neighbours[static_cast<std::size_t>(next)];
    for (const int i : around) {
      auto& mine = neighbours[static_cast<std::size_t>(i)];
      queue.erase({mine.size(), i});
      mine.insert(around.begin(), around.end());
      mine.erase(i);
      mine.erase(next);
      queue.emplace(mine.size(), i);
    }
  }
  return order;
}
}  // namespace

SparseLu::SparseLu(int n, std::span<const std::pair<int, int>> pattern) {
  const auto count = static_cast<std::size_t>(n);
  std::vector<std::set<int>> neighbours(count);
  for (const auto& [row, column] : pattern) {
    if (row == column) continue;
    neighbours[static_cast<std::size_t>(row)].insert(column);
    neighbours[static_cast<std::size_t>(column)].insert(row);
  }
  order_ = smallest_degree_order(neighbours);
  std::vector<int> place(count);
  for (std::size_t i = 0; i < count; ++i) place[static_cast<std::size_t>(order_[i])] = static_cast<int>(i);

  // Symbolic elimination, row by row: row i fills with the upper part of every row k < i that it meets.
  std::vector<std::set<int>> rows(count);
  for (std::size_t i = 0; i < count; ++i) rows[i].insert(static_cast<int>(i));
  for (const auto& [row, column] : pattern)
    rows[static_cast<std::size_t>(place[static_cast<std::size_t>(row)])].insert(
        place[static_cast<std::size_t>(column)]);
  for (std::size_t i = 0; i < count; ++i) {
    for (auto k = rows[i].begin(); k != rows[i].end() && *k < static_cast<int>(i); ++k) {
      const auto& above = rows[static_cast<std::size_t>(*k)];
      rows[i].insert(above.upper_bound(*k), above.end());
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    rows_.push_back(columns_.size());
    for (const int column : rows[i]) {
      if (column == static_cast<int>(i)) pivots_.push_back(columns_.size());
      columns_.push_back(column);
    }
  }
  rows_.push_back(columns_.size());
  for (const auto& [row, column] : pattern) {
    const auto i = static_cast<std::size_t>(place[static_cast<std::size_t>(row)]);
    const auto begin = columns_.begin() + static_cast<std::ptrdiff_t>(rows_[i]);
    const auto end = columns_.begin() + static_cast<std::ptrdiff_t>(rows_[i + 1]);
    const auto found = std::lower_bound(begin, end, place[static_cast<std::size_t>(column)]);
    targets_.push_back(static_cast<std::size_t>(found - columns_.begin()));
  }
  factors_.resize(columns_.size());
  inverse_pivots_.resize(count), work_.resize(count);
}

bool SparseLu::factorise(double s, std::span<const double> values) {
  std::fill(factors_.begin(), factors_.end(), 0.0);
  for (std::size_t e = 0; e < targets_.size(); ++e) factors_[targets_[e]] -= s * values[e];
  for (const std::size_t pivot : pivots_) factors_[pivot] += 1.0;
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const std::size_t begin = rows_[i], end = rows_[i + 1], pivot = pivots_[i];
    double largest = 0.0;
    for (std::size_t e = begin; e < end; ++e) {
      work_[static_cast<std::size_t>(columns_[e])] = factors_[e];
      largest = std::max(largest, std::abs(factors_[e]));
    }
    for (std::size_t e = begin; e < pivot; ++e) {
      const auto k = static_cast<std::size_t>(columns_[e]);
      const double l = work_[k] * inverse_pivots_[k];
      work_[k] = l;
      for (std::size_t u = pivots_[k] + 1; u < rows_[k + 1]; ++u)
        work_[static_cast<std::size_t>(columns_[u])] -= l * factors_[u];
    }
    for (std::size_t e = begin; e < end; ++e) factors_[e] = work_[static_cast<std::size_t>(columns_[e])];
    // Also false for NaN.
    if (!(std::abs(factors_[pivot]) > kTinyPivot * largest && std::isfinite(factors_[pivot]))) return false;
    inverse_pivots_[i] = 1.0 / factors_[pivot];
  }
  return true;
}

void SparseLu::solve(std::span<double> b) {
  const std::size_t n = order_.size();
  for (std::size_t i = 0; i < n; ++i) {
    double sum = b[static_cast<std::size_t>(order_[i])];
    for (std::size_t e = rows_[i]; e < pivots_[i]; ++e)
      sum -= factors_[e] * work_[static_cast<std::size_t>(columns_[e])];
    work_[i] = sum;
  }
  for (std::size_t i = n; i-- > 0;) {
    double sum = work_[i];
    for (std::size_t e = pivots_[i] + 1; e < rows_[i + 1]; ++e)
      sum -= factors_[e] * work_[static_cast<std::size_t>(columns_[e])];
    work_[i] = sum * inverse_pivots_[i];
    b[static_cast<std::size_t>(order_[i])] = work_[i];
  }
}

}  // namespace takt
