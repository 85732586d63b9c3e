#pragma once
// The full Jacobian d f / d x of a cell, by finite differences, and the solution of linear systems with it.
//
// The models of a cell form groups without mutual influence: a robot with all Parts that it carries, a Part
// on a table. Groups follow from the connections and change only with them. One evaluation of f gives one
// column in every group at once; each group is a dense block with its own LU.
#include <functional>
#include <span>
#include <vector>

#include "idl/common/disjoint_sets.h"
#include "server/simulation/solver/ode_system.h"

namespace takt {

class SystemJacobian {
 public:
  explicit SystemJacobian(const OdeSystem& system);

  /// f(t, x) into xdot; false if it is not finite.
  using Derivatives = std::function<bool(double t, const double* x, double* xdot)>;

  /// Finds the groups for the present connections. The influence of models of several bodies (robots) is
  /// tested at (t, x), with one evaluation per such model.
  void find_groups(const OdeSystem& system, double t, const double* x, const Derivatives& f);
  /// J at (t, x), where f(t, x) = f0. False if an evaluation failed.
  bool evaluate(double t, const double* x, const double* f0, const Derivatives& f);
  /// Factorises a I - b J. False if it is singular.
  bool factorise(double a, double b);
  /// Solves in place, n values.
  void solve(double* b);

  std::size_t group_count() const { return groups_.size(); }
  /// Evaluations per Jacobian: the number of states of the largest group.
  std::size_t columns() const { return largest_; }

 private:
  struct Group {
    std::size_t first = 0, size = 0;  ///< in states_
    std::size_t values = 0;           ///< first of its size * size entries
  };
  double increment(std::size_t state, double value) const;

  DisjointSets sets_;                ///< of blocks
  std::vector<std::size_t> states_;  ///< states, group by group
  std::vector<Group> groups_;
  std::size_t largest_ = 0;
  std::vector<double> scales_;
  std::vector<double> jacobian_, factors_;  ///< column-major blocks
  std::vector<int> pivots_;                 ///< row exchanges, by place in states_
  std::vector<double> x_, f0_, f1_, work_;
  std::vector<int> block_of_body_;
};

}  // namespace takt
