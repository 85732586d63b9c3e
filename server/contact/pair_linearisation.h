#pragma once
// Derivatives of the wrench between two bodies with respect to their relative motion, for implicit solvers.
#include <Eigen/Core>
#include <cstdint>

#include "plant_models/spatial.h"

namespace takt {

/// The tangent is the derivative, for Newton's method. For surface contact it contains penetration along the
/// Target's normal and the rotation of that normal about edges and vertices, damping that grows with
/// penetration, the normal velocity of a moving contact point, friction proportional to the normal force, and
/// points that move with the Base. It omits the change of direction and speed of sliding with displacement
/// (of the order mu f_n per rad).
///
/// The secant is symmetric, negative semidefinite and stable at any step size: stiffness and damping of each
/// element along its normal; friction by -mu f_n / |v_t| instead of its slope, independent of the normal
/// force; without rotation of normals. Stick law: tangential stiffness and damping of elements that stick;
/// one that slips counts as regularised friction, -mu f_n / max(|v_t|, v_eps), without stiffness.
///
/// Elements whose tension (2.20) cuts off contribute zero.
enum class Linearisation : std::uint8_t { secant, tangent };

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// K or D in the axes that R leads to.
inline Mat6 turned(const Mat3& R, const Mat6& m) {
  Mat6 result;
  for (int r = 0; r < 6; r += 3)
    for (int c = 0; c < 6; c += 3) result.block<3, 3>(r, c) = R * m.block<3, 3>(r, c) * R.transpose();
  return result;
}

/// K or D for wrenches and twists about p instead of the origin.
inline void move_point(const Vec3& p, Mat6& m) {
  for (int i = 0; i < 6; ++i) m.col(i).tail<3>() -= p.cross(m.col(i).head<3>());
  for (int i = 0; i < 6; ++i) m.row(i).tail<3>() -= p.cross(m.row(i).head<3>());
}

/// At the world point p_W, world axes, both vectors ordered linear, then angular:
///   dF = K d + D V,
/// F the wrench on `base` about p_W (force, moment; `target` gets -F), V the twist at p_W of base relative to
/// target (velocity, angular velocity), d the displacement. K and D of a stable system are negative. K holds
/// for a field of velocities that is fixed in space while the base is displaced.
///
/// p_W moves with the target. K of a tangent has the change of the moment about p_W. The point of the base that is at p_W now
/// moves by a, the linear part of d. About that point the moment changes by K d - a x f.
struct PairLinearisation {
  int base = -1, target = -1;  ///< component ids
  Vec3 p_W = Vec3::Zero();
  Mat6 K = Mat6::Zero(), D = Mat6::Zero();
  Vec3 f_W =
      Vec3::Zero();  ///< on the base, of a tangent whose p_W is the centre of mass of the base; else zero
};

}  // namespace takt
