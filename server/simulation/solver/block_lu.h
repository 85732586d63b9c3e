#pragma once
// LU factorisation of a sparse matrix of dense blocks whose pattern is symmetric, such as the couplings of
// bodies that touch. Rows are exchanged within the diagonal blocks alone: for matrices whose blocks on the
// diagonal dominate, as masses with the dissipative forces of contacts do. Unknowns with few couplings are
// eliminated first (smallest degree); the order and the places of the fill follow from the pattern alone and
// are found when it changes. Memory only grows.
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace takt {

class BlockLu {
 public:
  /// Unknowns first .. first + size - 1 of the right side.
  struct Node {
    std::size_t first = 0, size = 0;
    bool operator==(const Node&) const = default;
  };

  /// Room for the densest matrix of that size.
  void reserve(std::size_t nodes, std::size_t unknowns);
  /// Couplings: pairs of nodes, in any order, with repetitions. Independent parts of a matrix may be in one.
  void set_pattern(std::span<const Node> nodes, std::span<const std::pair<int, int>> couplings);

  /// All entries become zero. Then entries are added to the blocks, and factorise() replaces them.
  void clear();
  /// Block in row and column of these nodes, which must be in the pattern: column-major, size of row x size of
  /// column.
  double* block(int row, int column);
  /// Sets a row of the matrix, row `i` of a node, to zero.
  void clear_row(int node, std::size_t i);

  /// False if a block on the diagonal is singular or not finite; then solve() must not be called.
  bool factorise();
  /// Solves in place, in the right side of all unknowns.
  void solve(double* right) const;

  /// Blocks of the factors.
  std::size_t fill() const { return nodes_.size() + 2 * rows_.size(); }

 private:
  /// A block below the diagonal, with its mirror image above: of the place `column` in the elimination.
  struct Entry {
    std::size_t column = 0, lower = 0, upper = 0;
  };
  void find_order();
  void find_fill();
  std::size_t size(std::size_t place) const { return nodes_[order_[place]].size; }
  std::size_t entry(std::size_t row, std::size_t column) const;

  std::vector<Node> nodes_;
  std::vector<std::pair<int, int>> couplings_;
  std::vector<std::size_t> order_, place_;  ///< node by place in the elimination, and the reverse
  // By column, in the order of the elimination: the places of the blocks below the diagonal, ascending.
  std::vector<std::size_t> begin_, rows_, diagonal_;
  std::vector<Entry> entries_;
  std::vector<std::size_t> row_begin_, row_entries_;  ///< the same entries by row
  std::vector<double> values_;
  std::size_t used_ = 0;     ///< of them
  std::vector<int> pivots_;  ///< from Node::first on, as the unknowns are
  // Of the search for the order.
  std::vector<std::uint64_t> neighbours_;  ///< a bit for each pair of nodes
  std::vector<std::size_t> degrees_, next_;
};

}  // namespace takt
