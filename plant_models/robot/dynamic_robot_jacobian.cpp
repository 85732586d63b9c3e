// Structured approximation of the Jacobian of a robot: what its drives make stiff. Gravity,
// velocity-dependent forces and the coupling of jaws with the arm are left to the explicit part.
#include <Eigen/Cholesky>

#include "plant_models/robot/dynamic_robot_impl.h"

namespace takt {

namespace {

/// Calls emit(row, column, value) for every entry; `value` is a function evaluated only where needed. One
/// function for pattern and values, so that they cannot differ in order.
template <typename Model, typename Gain, typename Drives, typename Emit>
void for_each_entry(const Model& m, const Gain& gain, const Drives& J, const Emit& emit) {
  const int n = m.joints;
  for (int i = 0; i < n; ++i) emit(i, n + i, [] { return 1.0; });
  for (int i = 0; i < n; ++i) {
    const bool in_arm = i < m.arm;
    for (int j = in_arm ? 0 : i; j < (in_arm ? m.arm : i + 1); ++j) {
      const auto k = static_cast<size_t>(j);
      emit(n + i, j, [&] { return gain(i, j) * J[k].torque_dq; });
      emit(n + i, n + j, [&] { return gain(i, j) * J[k].torque_dqd; });
      for (int c = 0; c < m.drive(j).state_count(); ++c) {
        if (m.patterns[k].torque_dz[c])
          emit(n + i, m.z_begin[k] + c, [&] { return gain(i, j) * J[k].torque_dz[c]; });
      }
    }
  }
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    const DrivePattern& P = m.patterns[k];
    const int z = m.z_begin[k], count = m.drive(i).state_count();
    for (int r = 0; r < count; ++r) {
      if (P.dz_dq[r]) emit(z + r, i, [&] { return J[k].dz_dq[r]; });
      if (P.dz_dqd[r]) emit(z + r, n + i, [&] { return J[k].dz_dqd[r]; });
      for (int c = 0; c < count; ++c) {
        if (P.dz_dz[r][c]) emit(z + r, z + c, [&] { return J[k].dz_dz[r][c]; });
      }
    }
  }
}

}  // namespace

void DynamicRobot::jacobian_pattern(std::vector<std::pair<int, int>>& entries) const {
  const std::array<DriveJacobian, kMaxJoints> none{};
  for_each_entry(
      *impl_, [](int, int) { return 0.0; }, none,
      [&entries](int row, int column, const auto&) { entries.emplace_back(row, column); });
}

void DynamicRobot::jacobian(double t, const double* x, const CellMotion&, double* values) const {
  Impl& m = *impl_;
  m.update(x);
  std::array<JointReference, kMaxJoints> references;
  m.references(t, references);
  std::array<DriveJacobian, kMaxJoints> J{};
  const int n = m.joints, arm = m.arm;

  // Accelerations of the arm per drive torque, or per prescribed acceleration: with f free, p prescribed,
  // M_ff qdd_f + M_fp qdd_p = tau_f; locked joints have none.
  MultibodyTree::MassMatrix M, A, G;
  m.tree.mass_matrix(M, m.w);
  A = M.topLeftCorner(arm, arm);
  G.setIdentity(arm, arm);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    const double* z = m.drive_states(x, i);
    m.drive(i).jacobian(references[k], x[i], x[n + i], z, J[k]);
    if (i >= arm) continue;
    const DriveOutput output = m.drive(i).output(references[k], x[i], x[n + i], z);
    if (!output.locks_joint && !output.prescribes_acceleration) continue;
    A.row(i).setZero();
    A.col(i).setZero();
    A(i, i) = 1.0;
    G.col(i).setZero();
    if (output.prescribes_acceleration) {
      G.col(i) = -M.col(i).head(arm);
      G(i, i) = 1.0;
    }
  }
  // Rows of held joints: only their own prescription is left in G.
  for (int i = 0; i < arm; ++i) {
    const auto k = static_cast<size_t>(i);
    const DriveOutput output = m.drive(i).output(references[k], x[i], x[n + i], m.drive_states(x, i));
    if (!output.locks_joint && !output.prescribes_acceleration) continue;
    const double own = output.prescribes_acceleration ? 1.0 : 0.0;
    G.row(i).setZero();
    G(i, i) = own;
  }
  A.llt().solveInPlace(G);
  for_each_entry(
      m, [&G, arm](int i, int j) { return i < arm ? G(i, j) : 1.0; }, J,
      [&values](int, int, const auto& value) { *values++ = value(); });
}

}  // namespace takt
