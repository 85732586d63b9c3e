#pragma once
// LU factorisation of a sparse matrix with a constant pattern, without pivoting: the order of elimination and
// the places of the fill are computed once; a factorisation is then a fixed sequence of operations on
// preallocated numbers. For I - s A with a small s or a dissipative A, whose diagonal dominates.
#include <span>
#include <utility>
#include <vector>

namespace takt {

class SparseLu {
 public:
  /// Matrix of size n with the diagonal and the given (row, column) places, duplicates allowed. Elimination
  /// is by smallest degree, ties by index: unknowns with few couplings (a motor on its joint) go first.
  SparseLu(int n, std::span<const std::pair<int, int>> pattern);

  /// Factorises I - s A, with the values of A in the order of the pattern. False if a pivot is zero, tiny
  /// against its column's entries in the matrix or not finite; then solve() must not be called.
  bool factorise(double s, std::span<const double> values);
  /// Solves in place; b has n values.
  void solve(std::span<double> b);

  int size() const { return static_cast<int>(order_.size()); }
  /// Entries of the factors, diagonal included.
  std::size_t fill() const { return columns_.size(); }

 private:
  std::vector<int> order_;            ///< by place in the elimination: index of the unknown
  std::vector<std::size_t> rows_;     ///< beginning of each row in columns_, and the end
  std::vector<std::size_t> pivots_;   ///< by row: where its diagonal is
  std::vector<int> columns_;          ///< ascending within a row, in the order of elimination
  std::vector<std::size_t> targets_;  ///< by entry of the pattern: where it goes
  std::vector<double> factors_, inverse_pivots_, work_;
};

}  // namespace takt
