#include "server/components/component.h"

#include <cmath>

namespace takt {

double translational_stiffness(double mass_kg, double gravity_m_per_s2, double allowed_error_m) {
  return mass_kg * gravity_m_per_s2 / allowed_error_m;  // (5.7)
}

double translational_damping(double mass_kg, double stiffness_N_per_m, double damping_ratio) {
  return damping_ratio * 2.0 * std::sqrt(mass_kg * stiffness_N_per_m);  // (5.9)
}

SubstituteParameters substitute_parameters(double mass_kg, const Mat3& I_BBcm_B, double gravity_m_per_s2,
                                           double allowed_error_m, double damping_ratio) {
  SubstituteParameters p;
  p.k_tr_N_per_m = translational_stiffness(mass_kg, gravity_m_per_s2, allowed_error_m);
  p.d_tr_N_s_per_m = translational_damping(mass_kg, p.k_tr_N_per_m, damping_ratio);
  p.K_rot_B = I_BBcm_B * (p.k_tr_N_per_m / mass_kg);
  p.D_rot_B = I_BBcm_B * (p.d_tr_N_s_per_m / mass_kg);
  return p;
}

}  // namespace takt
