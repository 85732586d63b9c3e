#include "server/simulation/solver/block_lu.h"

#include <algorithm>
#include <bit>

#include "server/simulation/solver/dense_lu.h"

namespace takt {

namespace {

constexpr std::size_t kBits = 64, kBody = 6, kEliminated = static_cast<std::size_t>(-1);

std::size_t words(std::size_t nodes) {
  return (nodes + kBits - 1) / kBits;
}

template <class Visit>
void for_each_bit(std::span<const std::uint64_t> bits, const Visit& visit) {
  for (std::size_t w = 0; w < bits.size(); ++w)
    for (std::uint64_t left = bits[w]; left != 0; left &= left - 1)
      visit(w * kBits + static_cast<std::size_t>(std::countr_zero(left)));
}

/// C -= A B, column-major, with C of m x n and k columns of A.
inline void subtract_product(double* C, const double* A, const double* B, std::size_t m, std::size_t k,
                             std::size_t n) {
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t l = 0; l < k; ++l) {
      const double factor = B[j * k + l];
      for (std::size_t i = 0; i < m; ++i) C[j * m + i] -= factor * A[l * m + i];
    }
}

__attribute__((target_clones("avx2", "default"))) void subtract_body_product(double* C, const double* A,
                                                                             const double* B) {
  subtract_product(C, A, B, kBody, kBody, kBody);
}

void subtract(double* C, const double* A, const double* B, std::size_t m, std::size_t k, std::size_t n) {
  if (m == kBody && k == kBody && n == kBody)
    subtract_body_product(C, A, B);
  else
    subtract_product(C, A, B, m, k, n);
}

}  // namespace

void BlockLu::reserve(std::size_t nodes, std::size_t unknowns) {
  const std::size_t pairs = nodes * (nodes - std::min<std::size_t>(nodes, 1)) / 2;
  nodes_.reserve(nodes), couplings_.reserve(8 * nodes), order_.reserve(nodes), place_.reserve(nodes);
  begin_.reserve(nodes + 1), rows_.reserve(pairs), diagonal_.reserve(nodes), entries_.reserve(pairs);
  row_begin_.reserve(nodes + 1), row_entries_.reserve(pairs);
  values_.reserve(unknowns * unknowns), neighbours_.reserve(nodes * words(nodes));
  degrees_.reserve(nodes), next_.reserve(nodes);
}

void BlockLu::set_pattern(std::span<const Node> nodes, std::span<const std::pair<int, int>> couplings) {
  if (std::equal(nodes.begin(), nodes.end(), nodes_.begin(), nodes_.end()) &&
      std::equal(couplings.begin(), couplings.end(), couplings_.begin(), couplings_.end()))
    return;
  nodes_.assign(nodes.begin(), nodes.end());
  couplings_.assign(couplings.begin(), couplings.end());
  find_order();
  find_fill();
  std::size_t unknowns = 0;
  for (const Node& node : nodes_) unknowns = std::max(unknowns, node.first + node.size);
  if (pivots_.size() < unknowns) pivots_.resize(unknowns);
}

// By smallest degree, counted in unknowns; ties by index. Afterwards the bits of a node are its neighbours
// when it was eliminated, the columns of the factors.
void BlockLu::find_order() {
  const std::size_t n = nodes_.size(), width = words(n);
  neighbours_.assign(n * width, 0);
  degrees_.assign(n, 0), order_.resize(n), place_.resize(n);
  const auto bits = [&](std::size_t node) { return std::span(neighbours_).subspan(node * width, width); };
  const auto set = [&](std::size_t i, std::size_t k) {
    bits(i)[k / kBits] |= std::uint64_t{1} << (k % kBits);
  };
  const auto reset = [&](std::size_t i, std::size_t k) {
    bits(i)[k / kBits] &= ~(std::uint64_t{1} << (k % kBits));
  };
  const auto count = [&](std::size_t node) {
    degrees_[node] = 0;
    for_each_bit(bits(node), [&](std::size_t k) { degrees_[node] += nodes_[k].size; });
  };
  for (const auto& [one, other] : couplings_) {
    if (one == other) continue;
    set(static_cast<std::size_t>(one), static_cast<std::size_t>(other));
    set(static_cast<std::size_t>(other), static_cast<std::size_t>(one));
  }
  for (std::size_t i = 0; i < n; ++i) count(i);
  for (std::size_t place = 0; place < n; ++place) {
    const auto next =
        static_cast<std::size_t>(std::min_element(degrees_.begin(), degrees_.end()) - degrees_.begin());
    order_[place] = next, place_[next] = place;
    const auto around = bits(next);
    for_each_bit(around, [&](std::size_t i) {
      const auto mine = bits(i);
      for (std::size_t w = 0; w < width; ++w) mine[w] |= around[w];
      reset(i, i), reset(i, next);
      count(i);
    });
    degrees_[next] = kEliminated;
  }
}

void BlockLu::find_fill() {
  const std::size_t n = nodes_.size(), width = words(n);
  begin_.clear(), rows_.clear(), diagonal_.clear(), entries_.clear();
  used_ = 0;
  const auto take = [&](std::size_t rows, std::size_t columns) {
    used_ += rows * columns;
    return used_ - rows * columns;
  };
  row_begin_.assign(n + 1, 0);
  for (std::size_t column = 0; column < n; ++column) {
    begin_.push_back(rows_.size());
    const auto first = static_cast<std::ptrdiff_t>(rows_.size());
    for_each_bit(std::span<const std::uint64_t>(neighbours_).subspan(order_[column] * width, width),
                 [&](std::size_t node) { rows_.push_back(place_[node]); });
    std::sort(rows_.begin() + first, rows_.end());
    const std::size_t mine = size(column);
    diagonal_.push_back(take(mine, mine));
    for (auto row = rows_.begin() + first; row != rows_.end(); ++row) {
      Entry& entry = entries_.emplace_back();
      entry.column = column;
      entry.lower = take(size(*row), mine);
      entry.upper = take(mine, size(*row));
      ++row_begin_[*row + 1];
    }
  }
  begin_.push_back(rows_.size());
  for (std::size_t row = 0; row < n; ++row) row_begin_[row + 1] += row_begin_[row];
  next_.assign(row_begin_.begin(), row_begin_.end() - 1);
  row_entries_.resize(rows_.size());
  for (std::size_t e = 0; e < rows_.size(); ++e) row_entries_[next_[rows_[e]]++] = e;
  if (values_.size() < used_) values_.resize(used_);
}

void BlockLu::clear() {
  std::fill_n(values_.begin(), used_, 0.0);
}

std::size_t BlockLu::entry(std::size_t row, std::size_t column) const {
  const auto begin = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[column]);
  const auto end = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[column + 1]);
  return static_cast<std::size_t>(std::lower_bound(begin, end, row) - rows_.begin());
}

double* BlockLu::block(int row, int column) {
  const std::size_t i = place_[static_cast<std::size_t>(row)], k = place_[static_cast<std::size_t>(column)];
  if (i == k) return &values_[diagonal_[i]];
  return &values_[i > k ? entries_[entry(i, k)].lower : entries_[entry(k, i)].upper];
}

void BlockLu::clear_row(int node, std::size_t i) {
  const std::size_t place = place_[static_cast<std::size_t>(node)], mine = size(place);
  const auto clear = [&](std::size_t block, std::size_t columns) {
    for (std::size_t k = 0; k < columns; ++k) values_[block + k * mine + i] = 0.0;
  };
  clear(diagonal_[place], mine);
  for (std::size_t e = begin_[place]; e < begin_[place + 1]; ++e) clear(entries_[e].upper, size(rows_[e]));
  for (std::size_t r = row_begin_[place]; r < row_begin_[place + 1]; ++r) {
    const Entry& entry = entries_[row_entries_[r]];
    clear(entry.lower, size(entry.column));
  }
}

// Column by column: L keeps its blocks on the diagonal, and U has ones there.
bool BlockLu::factorise() {
  for (std::size_t j = 0; j < nodes_.size(); ++j) {
    const std::size_t n = size(j);
    double* diagonal = &values_[diagonal_[j]];
    for (std::size_t r = row_begin_[j]; r < row_begin_[j + 1]; ++r) {
      const std::size_t e = row_entries_[r], k = entries_[e].column, between = size(k);
      const double *L_jk = &values_[entries_[e].lower], *U_kj = &values_[entries_[e].upper];
      subtract(diagonal, L_jk, U_kj, n, between, n);
      // The rows of column k below j are rows of column j, too.
      std::size_t mine = begin_[j];
      for (std::size_t below = e + 1; below < begin_[k + 1]; ++below) {
        while (rows_[mine] != rows_[below]) ++mine;
        const std::size_t m = size(rows_[below]);
        subtract(&values_[entries_[mine].lower], &values_[entries_[below].lower], U_kj, m, between, n);
        subtract(&values_[entries_[mine].upper], L_jk, &values_[entries_[below].upper], n, between, m);
      }
    }
    int* pivots = &pivots_[nodes_[order_[j]].first];
    if (!factorise_dense(diagonal, n, pivots)) return false;
    for (std::size_t e = begin_[j]; e < begin_[j + 1]; ++e)
      for (std::size_t column = 0; column < size(rows_[e]); ++column)
        solve_dense(diagonal, n, pivots, &values_[entries_[e].upper + column * n]);
  }
  return true;
}

void BlockLu::solve(double* right) const {
  const auto part = [&](std::size_t place) { return right + nodes_[order_[place]].first; };
  for (std::size_t j = 0; j < nodes_.size(); ++j) {
    double* mine = part(j);
    for (std::size_t r = row_begin_[j]; r < row_begin_[j + 1]; ++r) {
      const Entry& entry = entries_[row_entries_[r]];
      subtract_product(mine, &values_[entry.lower], part(entry.column), size(j), size(entry.column), 1);
    }
    solve_dense(&values_[diagonal_[j]], size(j), &pivots_[nodes_[order_[j]].first], mine);
  }
  for (std::size_t j = nodes_.size(); j-- > 0;)
    for (std::size_t e = begin_[j]; e < begin_[j + 1]; ++e)
      subtract_product(part(j), &values_[entries_[e].upper], part(rows_[e]), size(j), size(rows_[e]), 1);
}

}  // namespace takt
