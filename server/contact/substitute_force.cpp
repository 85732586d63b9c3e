#include "server/contact/substitute_force.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace takt {

void capture_offset(const BodyMotion& base, const BodyMotion& target, Connection& connection) {
  const Mat3 R_TW = target.X_WB.R.transpose();
  connection.p_TBcm_T = R_TW * (base.p_WBcm - target.X_WB.p);  // (3.1), (3.2)
  connection.R_TB = R_TW * base.X_WB.R;                        // (3.7)
}

SubstituteParameters gains_on_free_target(const Component& base, const Component& target,
                                          double lever_arm_m) {
  const Mat3 I_target_inverse = target.I_BBcm_B.inverse();
  const double compliance = Eigen::SelfAdjointEigenSolver<Mat3>(I_target_inverse).eigenvalues().maxCoeff();
  const double base_inertia = Eigen::SelfAdjointEigenSolver<Mat3>(base.I_BBcm_B).eigenvalues().maxCoeff();
  const double inverse_base = 1.0 / base.mass_kg;
  const double inverse_both = inverse_base + 1.0 / target.mass_kg + lever_arm_m * lever_arm_m * compliance;
  const double scale_tr = inverse_base / inverse_both;
  const double scale_rot = 1.0 / (1.0 + base_inertia * compliance);
  SubstituteParameters gains = base.substitute;
  gains.k_tr_N_per_m *= scale_tr;
  gains.d_tr_N_s_per_m *= scale_tr;
  gains.K_rot_B *= scale_rot;
  gains.D_rot_B *= scale_rot;
  return gains;
}

Wrench substitute_wrench(const Connection& connection, const BodyMotion& base, const BodyMotion& target) {
  const Mat3& R_WT = target.X_WB.R;
  const Mat3& R_WB = base.X_WB.R;

  // Force: (3.5), with the velocity of the Target-fixed point at the Base's centre of mass.
  const Vec3 p_desired = target.X_WB.p + R_WT * connection.p_TBcm_T;  // (3.3)
  const Vec3 v_target = target.V_WB.at(base.p_WBcm - target.X_WB.p);
  const Vec3 v_base = base.V_WB.at(base.p_WBcm - base.X_WB.p);
  Wrench F;
  F.f = connection.gains.k_tr_N_per_m * (p_desired - base.p_WBcm) +
        connection.gains.d_tr_N_s_per_m * (v_target - v_base) + connection.feed_forward_W;

  // Torque: rotation that takes the Base to its desired orientation, as a vector in world axes: the
  // antisymmetric part of R_desired R_WB^T, which is sin(angle) times the axis (3.9), (3.10).
  const Mat3 E = (R_WT * connection.R_TB) * R_WB.transpose();
  const Vec3 alpha_W = 0.5 * Vec3(E(2, 1) - E(1, 2), E(0, 2) - E(2, 0), E(1, 0) - E(0, 1));
  const Vec3 alpha_B = R_WB.transpose() * alpha_W;
  const Vec3 slip_B = R_WB.transpose() * (target.V_WB.w - base.V_WB.w);                   // (3.11)
  F.t = R_WB * (connection.gains.K_rot_B * alpha_B + connection.gains.D_rot_B * slip_B);  // (3.12), (3.13)
  return F;
}

}  // namespace takt
