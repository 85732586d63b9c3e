#pragma once
// Form of a plant model with inertia for solvers that have to solve
//   (a I - b J) y = r        J = d x' / d x,  a, b > 0,
// over the whole state vector: reduced to its velocities u. Positions follow from their velocities alone, so
// they are eliminated exactly; so are states that only one joint depends on (drives). The rest are equations
// of motion, to which forces between models add (server/simulation/solver/velocity_system.h).
//
// With M the mass matrix, r_u the part of r that belongs to the velocities, and displacements counted in the
// directions of the velocities, so that d = (d_r + b u) / a is the displacement by y:
//   free velocities       sum_j (a M_ij + row_i delta_ij) u_j = sum_j M_ij r_u,j + right_i + b Q_i
//   prescribed ones       row_i u_i = right_i
// Q_i are the generalised forces that y changes between models.
//
// Velocity-dependent inertial forces and the change of M, of gravity and of the directions with the positions
// are omitted. So this is a Jacobian for methods whose order does not depend on it (W-methods) and for
// Newton's method, which it slows down a little.
#include <span>
#include <vector>

#include "plant_models/spatial.h"

namespace takt {

struct CellMotion;

class VelocityForm {
 public:
  static constexpr int kMaxVelocities = 16;
  /// A row of the equations above.
  struct Row {
    double value = 0.0;
    bool prescribed = false;
  };

  virtual ~VelocityForm() = default;
  virtual int velocity_count() const = 0;  ///< at most kMaxVelocities
  /// Components that move with these velocities.
  virtual std::vector<int> bodies() const = 0;

  /// Linearises at (t, x), the point of the last evaluation of motion and wrenches; the other functions refer
  /// to it. Writes M, column-major.
  virtual void linearise(double t, const double* x, const CellMotion& motion,
                         std::span<const Wrench> wrenches, double* M) = 0;
  /// Twist of a body at the point p_W per velocity, world axes: 6 x velocity_count(), column-major, velocity
  /// above angular velocity.
  virtual void body_jacobian(int body, const Vec3& p_W, double* J) const = 0;

  /// Factorises for these a and b: writes velocity_count() rows. False if the eliminated block is singular.
  virtual bool factorise(double a, double b, Row* rows) = 0;
  /// Adds the effect of each velocity of the model on the rows of others, besides M, to a column-major matrix
  /// of the model's velocities with this distance between columns. After factorise().
  virtual void add_couplings(double* matrix, std::size_t stride) const {
    static_cast<void>(matrix), static_cast<void>(stride);
  }
  /// Splits a right side r (all states of the model): the displacements d_r, the velocities' part r_u and the
  /// contribution of the eliminated states to the right side.
  virtual void reduce(const double* r, double* d_r, double* r_u, double* right) = 0;
  /// Replaces r by y for the solution u. The last reduce() must have had the same r.
  virtual void expand(const double* u, double* r) const = 0;
};

}  // namespace takt
