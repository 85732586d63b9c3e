#pragma once
// Coulomb friction with break-away, of a motor shaft or a joint.
//
// True friction: while sliding the torque is s (Rv0 + Rv1 |v|), s the direction of sliding; sticking holds v
// = 0 by the necessary torque and ends when this exceeds peak * Rv0; the shaft then slides in the direction
// of that torque, with the sliding value. Sliding ends when v reaches zero or reverses. The mode is discrete:
// within a mode the law is linear in v (also for a small overshoot of the solver past v = 0).
//
// Regularised: Rv0 tanh(v / v_eps) + Rv1 v. No modes; creeps where true friction sticks.
#include <cmath>

namespace takt {

/// Modes of true friction: switched between accepted steps only.
enum class FrictionMode : signed char { backward = -1, stuck = 0, forward = 1 };

struct FrictionParameters {
  double zero_speed_N_m = 0.0;                   ///< Rv0 (N m, or N where the joint is prismatic)
  double slope_N_m_s = 0.0;                      ///< Rv1 (N m s/rad)
  double break_away = 1.0;                       ///< peak, >= 1, break-away torque per Rv0
  bool regularised = false;                      ///< tanh instead of modes
  double regularisation_speed_rad_per_s = 0.01;  ///< v_eps

  bool has_modes() const { return !regularised && zero_speed_N_m > 0.0; }
  double break_away_torque() const { return break_away * zero_speed_N_m; }

  /// Torque against the motion; zero while stuck, where the dynamics decide.
  double torque(FrictionMode mode, double v) const {
    if (!has_modes()) return zero_speed_N_m * std::tanh(v / regularisation_speed_rad_per_s) + slope_N_m_s * v;
    if (mode == FrictionMode::stuck) return 0.0;
    return static_cast<double>(mode) * zero_speed_N_m + slope_N_m_s * v;
  }
  /// d torque / d v.
  double torque_dv(FrictionMode mode, double v) const {
    if (has_modes()) return mode == FrictionMode::stuck ? 0.0 : slope_N_m_s;
    const double th = std::tanh(v / regularisation_speed_rad_per_s);
    return zero_speed_N_m * (1.0 - th * th) / regularisation_speed_rad_per_s + slope_N_m_s;
  }
};

}  // namespace takt
