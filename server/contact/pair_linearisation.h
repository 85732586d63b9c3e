#pragma once
// How the wrench between two bodies changes with their relative motion: what implicit solvers need of a force
// element.
#include <Eigen/Core>

#include "plant_models/spatial.h"

namespace takt {

/// Of friction (shared/design numerics): the tangent is the derivative; the secant, -mu f_n / |v_t| instead
/// of its slope and without the coupling of normal force to friction, is symmetric and stable at any step
/// size.
enum class Linearisation : std::uint8_t { secant, tangent };

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// At the world point p_W, world axes, both vectors ordered linear, then angular:
///   dF = K d + D V,
/// F the wrench on `base` about p_W (force, moment; `target` gets -F), V the twist at p_W of base relative to
/// target (velocity, angular velocity), d the displacement that it makes. K and D of something stable are
/// negative. What turning p_W's lever or the force itself adds is left out.
struct PairLinearisation {
  int base = -1, target = -1;  ///< component ids
  Vec3 p_W = Vec3::Zero();
  Mat6 K = Mat6::Zero(), D = Mat6::Zero();
};

}  // namespace takt
