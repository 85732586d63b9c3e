#pragma once
// How the wrench between two bodies changes with their relative motion: what implicit solvers need of a force
// element.
#include <Eigen/Core>
#include <cstdint>

#include "plant_models/spatial.h"

namespace takt {

/// The tangent is the derivative, for Newton's method. Of surface contact it contains: penetration along the
/// Target's normal and the turn of that normal about edges and vertices, damping that grows with penetration,
/// normal velocity of a point that moves on, friction that follows the normal
/// force, points that move with the Base. Left out: how direction and speed of sliding change with
/// displacement (of the order mu f_n per rad).
///
/// The secant is symmetric, negative semidefinite and stable at any step size: stiffness and damping of each
/// element along its normal; friction by -mu f_n / |v_t| instead of its slope and not following the normal
/// force; nothing turns. Stick law: tangential stiffness and damping of elements that hold; one that slips
/// counts as regularised friction, -mu f_n / max(|v_t|, v_eps), without stiffness.
///
/// Elements that (2.20) keeps from pulling contribute nothing.
enum class Linearisation : std::uint8_t { secant, tangent };

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// At the world point p_W, world axes, both vectors ordered linear, then angular:
///   dF = K d + D V,
/// F the wrench on `base` about p_W (force, moment; `target` gets -F), V the twist at p_W of base relative to
/// target (velocity, angular velocity), d the displacement that it makes. K and D of something stable are
/// negative. K holds for a field of velocities that stays where it is while the base is displaced.
struct PairLinearisation {
  int base = -1, target = -1;  ///< component ids
  Vec3 p_W = Vec3::Zero();
  Mat6 K = Mat6::Zero(), D = Mat6::Zero();
};

}  // namespace takt
