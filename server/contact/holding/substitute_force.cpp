#include "server/contact/holding/substitute_force.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

namespace takt {

void capture_offset(const BodyMotion& base, const BodyMotion& target, Connection& connection) {
  const Mat3 R_TW = target.X_WB.R.transpose();
  connection.p_TBcm_T = R_TW * (base.p_WBcm - target.X_WB.p);  // (3.1), (3.2)
  connection.R_TB = R_TW * base.X_WB.R;                        // (3.7)
}

void turn_offset(const ConnectionTurn& turn, Connection& connection) {
  connection.p_TBcm_T += connection.R_TB * (turn.travel_m * turn.axis_B);
  connection.R_TB = connection.R_TB * Eigen::AngleAxisd(turn.angle_rad, turn.axis_B).toRotationMatrix();
  connection.turn = turn;
}

namespace {
/// Largest eigenvalue of M^-1 K.
template <typename Matrix>
double largest_ratio(const Matrix& K, const Matrix& M) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<Matrix>(K, M, Eigen::EigenvaluesOnly)
      .eigenvalues()
      .maxCoeff();
}
}  // namespace

void FreeTargetLoad::note_rates(const Component& base) {
  const SubstituteParameters& own = base.substitute;
  stiffest_ =
      std::max({stiffest_, own.k_tr_N_per_m / base.mass_kg, largest_ratio(own.K_rot_B, base.I_BBcm_B)});
  most_damped_ =
      std::max({most_damped_, own.d_tr_N_s_per_m / base.mass_kg, largest_ratio(own.D_rot_B, base.I_BBcm_B)});
}

void FreeTargetLoad::add_own() {
  const SubstituteParameters& own = own_->substitute;
  note_rates(*own_);
  K_T_.diagonal().head<3>().array() += own.k_tr_N_per_m;
  D_T_.diagonal().head<3>().array() += own.d_tr_N_s_per_m;
  K_T_.bottomRightCorner<3, 3>() += own.K_rot_B;
  D_T_.bottomRightCorner<3, 3>() += own.D_rot_B;
}

void FreeTargetLoad::add(const Component& base, const Connection& connection) {
  const SubstituteParameters& own = base.substitute;
  note_rates(base);
  // Moved by u and turned by a, the Target moves the point at the Base's centre of mass by u + a x r.
  const Vec3 r = connection.p_TBcm_T - inertia_.p_BBcm_B;
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J.leftCols<3>().setIdentity();
  J.rightCols<3>() << 0.0, r.z(), -r.y(), -r.z(), 0.0, r.x(), r.y(), -r.x(), 0.0;
  const Mat3& R = connection.R_TB;
  K_T_ += own.k_tr_N_per_m * (J.transpose() * J);
  K_T_.bottomRightCorner<3, 3>() += R * own.K_rot_B * R.transpose();
  D_T_ += own.d_tr_N_s_per_m * (J.transpose() * J);
  D_T_.bottomRightCorner<3, 3>() += R * own.D_rot_B * R.transpose();
}

FreeTargetLoad::Mat6 FreeTargetLoad::inertia() const {
  Mat6 M_T = Mat6::Zero();
  M_T.diagonal().head<3>().setConstant(inertia_.mass_kg);
  M_T.bottomRightCorner<3, 3>() = inertia_.I_BBcm_B;
  return M_T;
}

double FreeTargetLoad::shared_scale() const {
  if (stiffest_ == 0.0) return 1.0;
  const Mat6 M_T = inertia();
  return std::min(
      {1.0, 0.5 * stiffest_ / largest_ratio(K_T_, M_T), 0.5 * most_damped_ / largest_ratio(D_T_, M_T)});
}

double FreeTargetLoad::scale() const {
  const Mat6 M_T = inertia();
  return std::min(stiffest_ / (stiffest_ + largest_ratio(K_T_, M_T)),
                  most_damped_ / (most_damped_ + largest_ratio(D_T_, M_T)));
}

SubstituteParameters scaled(const SubstituteParameters& gains, double factor) {
  return {factor * gains.k_tr_N_per_m, factor * gains.d_tr_N_s_per_m, factor * gains.K_rot_B,
          factor * gains.D_rot_B};
}

Wrench substitute_wrench(const Connection& connection, const BodyMotion& base, const BodyMotion& target,
                         double time_s) {
  const Mat3& R_WT = target.X_WB.R;
  const Mat3& R_WB = base.X_WB.R;

  // Force: (3.5), with the velocity of the Target-fixed point at the Base's centre of mass.
  const Vec3 p_desired = target.X_WB.p + R_WT * connection.p_TBcm_T;  // (3.3)
  const Vec3 v_target = target.V_WB.at(base.p_WBcm - target.X_WB.p);
  const Vec3 v_base = base.V_WB.at(base.p_WBcm - base.X_WB.p);
  Wrench F;
  F.f = connection.gains.k_tr_N_per_m * (p_desired - base.p_WBcm) +
        connection.gains.d_tr_N_s_per_m * (v_target - v_base) + connection.feed_forward_W;
  if (connection.slides)
    F.f += (connection.gains.k_tr_N_per_m * (time_s - connection.slide_from_s) +
            connection.gains.d_tr_N_s_per_m) *
           connection.slide_W;

  // Torque: rotation that takes the Base to its desired orientation, as a vector in world axes: the
  // antisymmetric part of R_desired R_WB^T, which is sin(angle) times the axis (3.9), (3.10).
  const Mat3 E = (R_WT * connection.R_TB) * R_WB.transpose();
  const Vec3 alpha_W = 0.5 * Vec3(E(2, 1) - E(1, 2), E(0, 2) - E(2, 0), E(1, 0) - E(0, 1));
  const Vec3 alpha_B = R_WB.transpose() * alpha_W;
  Vec3 slip_B = R_WB.transpose() * (target.V_WB.w - base.V_WB.w);  // (3.11)
  if (const ConnectionTurn& turn = connection.turn; turn.driver >= 0) {
    F.f += connection.gains.d_tr_N_s_per_m * (turn.travel_m / turn.step_s) * (R_WB * turn.axis_B);
    slip_B += turn.angle_rad / turn.step_s * turn.axis_B;
  }
  F.t = R_WB * (connection.gains.K_rot_B * alpha_B + connection.gains.D_rot_B * slip_B);  // (3.12), (3.13)
  return F;
}

PairLinearisation substitute_linearisation(int base_id, const Connection& connection,
                                           const BodyMotion& base) {
  const Mat3& R_WB = base.X_WB.R;
  PairLinearisation pair;
  pair.base = base_id;
  pair.target = connection.partner;
  pair.p_W = base.p_WBcm;
  pair.K.diagonal().head<3>().setConstant(-connection.gains.k_tr_N_per_m);
  pair.D.diagonal().head<3>().setConstant(-connection.gains.d_tr_N_s_per_m);
  pair.K.bottomRightCorner<3, 3>() = -(R_WB * connection.gains.K_rot_B * R_WB.transpose());
  pair.D.bottomRightCorner<3, 3>() = -(R_WB * connection.gains.D_rot_B * R_WB.transpose());
  return pair;
}

}  // namespace takt
