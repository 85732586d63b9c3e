#pragma once
// The linear systems of implicit methods, (a I - b J) y = r over the whole state vector of a cell, solved at
// velocity level: models with inertia are reduced to their velocities (plant_models/velocity_form.h), the
// forces between them added pair by pair (contact/pair_linearisation.h). With J_p the twist of the bodies of
// a pair relative to each other, at its point, per velocity:
//   (a M - b J_p^T D J_p - b^2/a J_p^T K J_p + ...) u = M r_u + b/a J_p^T K J_p d_r + ...
// Models that pairs join directly or through others make one group. Up to kMaxDense velocities it has one
// dense LU with pivoting, n^3 / 3; larger groups (heaps, stacks) share one sparse LU of blocks, a block for
// each model (block_lu.h). Grounds and kinematic robots have no unknowns and join no models. A model
// without velocities is a block of its own, of its jacobian_pattern(); without a pattern it is treated
// explicitly, y = r / a.
//
// J lacks the terms that VelocityForm omits, the couplings of the robots' energies, and the change of the
// points and axes of forces as bodies move. W-methods keep their order with it; Newton's method needs some
// more iterations.
//
// Groups may change with every linearisation, as contacts do. Memory only grows: up to kRoomForAll velocities
// the space for the densest system is reserved; beyond that it grows when groups need more.
#include <memory>
#include <span>
#include <vector>

#include "idl/common/disjoint_sets.h"
#include "server/simulation/solver/block_lu.h"
#include "server/simulation/solver/ode_system.h"

namespace takt {

class VelocitySystem {
 public:
  static constexpr std::size_t kRoomForAll = 256;
  static constexpr std::size_t kMaxDense = 48;

  explicit VelocitySystem(const OdeSystem& system);

  /// J at (t, x), the point of the system's last derivatives(). Models at rest (OdeSystem::set_awake) take no
  /// part: their entries of later right sides stay unchanged.
  void linearise(OdeSystem& system, double t, std::span<const double> x, Linearisation of_friction);
  /// The same in two parts, the pairs at the system's present motion and the rest after derivatives() there:
  /// surface contacts are then evaluated once for both.
  void linearise_pairs(const OdeSystem& system, Linearisation of_friction) {
    system.linearise(of_friction, pairs_);
  }
  void linearise_models(OdeSystem& system, double t, std::span<const double> x);
  /// Factorises a I - b J. May be repeated with other a and b. False if the matrix is singular.
  bool factorise(double a, double b);
  /// Solves in place. `rate_share`: how much of the rates of pair forces that moving bodies without states
  /// cause (kinematic grippers) is added to the right side; the models' own are in
  /// OdeSystem::time_derivative.
  void solve(std::span<double> r, double rate_share = 0.0);

  /// Index of the segment that moves a body with velocities of its own, or -1.
  std::span<const int> units_of_bodies() const { return unit_of_body_; }
  std::size_t group_count() const { return groups_.size(); }
  std::size_t largest_group() const { return largest_group_; }  ///< velocities
  std::span<const PairLinearisation> pairs() const { return pairs_; }

 private:
  /// One model.
  struct Unit {
    std::unique_ptr<VelocityForm> form;  ///< null: a block of its own, or explicit
    const PlantModel* model = nullptr;
    std::size_t begin = 0, states = 0;  ///< in the state vector
    std::size_t velocities = 0;
    std::size_t first_velocity = 0;  ///< in the arrays over all velocities
    bool active = false;
    std::size_t group = 0, place = 0;  ///< where its velocities are in the group
    int node = -1;                     ///< in the sparse system, if the group is in it
    std::vector<double> mass;
    std::vector<VelocityForm::Row> rows;
    // Without velocities.
    std::vector<std::pair<int, int>> pattern;
    std::vector<double> values, block;
    std::vector<int> pivots;
  };
  struct End {
    int unit = -1;
    std::size_t J = 0;  ///< first of its entries in jacobians_: 6 x velocities, column-major
  };
  struct PairEnds {
    End base, target;
    Eigen::Matrix<double, 6, 1> rate;  ///< of the wrench on the base, at equal states
    Vec3 moved_by_time;                ///< velocity at the point, of bodies without states
  };
  struct Group {
    std::size_t first = 0, size = 0;  ///< in the vectors over grouped velocities
    std::size_t matrix = 0;           ///< first of its entries, if it is dense
    bool is_dense() const { return size <= kMaxDense; }
  };
  /// Place of a block of the matrix, column-major.
  struct BlockPlace {
    double* values;
    std::size_t stride;  ///< between columns
  };

  int unit_of(int body) const;
  void find_groups();
  void find_rates(OdeSystem& system, double t);
  void assemble(double a, double b);
  void add_pair(const Mat6& G, const Vec3& f_W, double moved, const PairEnds& ends);
  bool factorise_block(Unit& unit, double a, double b) const;
  void set_sparse_pattern();
  BlockPlace block_of(const Unit& row, const Unit& column);
  /// Column of a velocity in the Jacobian of an end.
  Eigen::Map<const Eigen::Matrix<double, 6, 1>> column_of(const End& end, std::size_t velocity) const {
    return Eigen::Map<const Eigen::Matrix<double, 6, 1>>(&jacobians_[end.J + 6 * velocity]);
  }
  void clear_row(const Unit& unit, std::size_t i);

  std::vector<Unit> units_;
  std::vector<std::size_t> active_;  ///< units that take part and have states, ascending
  std::vector<int> unit_of_body_;
  DisjointSets sets_;  ///< of units
  std::vector<PairLinearisation> pairs_;
  std::vector<PairEnds> ends_;
  std::vector<double> jacobians_;  ///< of the ends
  std::vector<Group> groups_;
  std::vector<double> matrices_;  ///< of the dense groups
  BlockLu sparse_;                ///< of the others
  std::vector<BlockLu::Node> nodes_;
  std::vector<std::pair<int, int>> couplings_;
  std::vector<int> pivots_;
  std::vector<double> right_;               ///< by group and place
  std::vector<double> displacement_, r_u_;  ///< by unit
  std::vector<Twist> twists_;               ///< by body
  std::size_t largest_group_ = 0;
  bool has_rates_ = false;
  double a_ = 1.0, b_ = 0.0;
};

}  // namespace takt
