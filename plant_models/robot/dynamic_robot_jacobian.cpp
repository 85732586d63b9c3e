// Structured approximation of the Jacobian of a robot: the stiff terms of its drives. Gravity,
// velocity-dependent forces and the coupling of jaws with the arm are left to the explicit part.
#include <Eigen/Cholesky>
#include <algorithm>

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

// With f free, p prescribed: M_ff qdd_f + M_fp qdd_p = tau_f; locked joints have no acceleration.
const MultibodyTree::MassMatrix& DynamicRobot::Impl::arm_gain(double t, const double* x) {
  if (t == gain_t && std::equal(gain_x.begin(), gain_x.end(), x)) return gain;
  update(x);
  std::array<JointReference, kMaxJoints> reference_now;
  references(t, reference_now);
  MultibodyTree::MassMatrix M, A;
  tree.mass_matrix(M, w);
  A = M.topLeftCorner(arm, arm);
  gain.setIdentity(arm, arm);
  std::array<DriveOutput, kMaxJoints> output;
  for (int i = 0; i < arm; ++i) {
    const auto k = static_cast<size_t>(i);
    output[k] = drive(i).output(reference_now[k], x[i], x[joints + i], drive_states(x, i));
    if (!output[k].locks_joint && !output[k].prescribes_acceleration) continue;
    A.row(i).setZero();
    A.col(i).setZero();
    A(i, i) = 1.0;
    gain.col(i).setZero();
    if (output[k].prescribes_acceleration) gain.col(i) = -M.col(i).head(arm);
  }
  // Rows of held joints: only their own prescription is left.
  for (int i = 0; i < arm; ++i) {
    const DriveOutput& held = output[static_cast<size_t>(i)];
    if (!held.locks_joint && !held.prescribes_acceleration) continue;
    gain.row(i).setZero();
    gain(i, i) = held.prescribes_acceleration ? 1.0 : 0.0;
  }
  A.llt().solveInPlace(gain);
  gain_t = t;
  std::copy(x, x + states, gain_x.begin());
  return gain;
}

void DynamicRobot::jacobian(double t, const double* x, const CellMotion&, double* values) const {
  Impl& m = *impl_;
  std::array<JointReference, kMaxJoints> references;
  m.references(t, references);
  std::array<DriveJacobian, kMaxJoints> J{};
  for (int i = 0; i < m.joints; ++i) {
    const auto k = static_cast<size_t>(i);
    m.drive(i).jacobian(references[k], x[i], x[m.joints + i], m.drive_states(x, i), J[k]);
  }
  const MultibodyTree::MassMatrix& G = m.arm_gain(t, x);
  const int arm = m.arm;
  for_each_entry(
      m, [&G, arm](int i, int j) { return i < arm ? G(i, j) : 1.0; }, J,
      [&values](int, int, const auto& value) { *values++ = value(); });
}

void DynamicRobot::time_derivative(double t, const double* x, const CellMotion&, double* rate) const {
  Impl& m = *impl_;
  std::array<JointReference, kMaxJoints> references;
  m.references(t, references);
  const MultibodyTree::MassMatrix& G = m.arm_gain(t, x);
  const int n = m.joints;
  const bool known = t == m.yielding_t && std::equal(m.yielding_x.begin(), m.yielding_x.end(), x);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    if (known && m.yielding[k]) continue;  // its torque is at the limit and stays there
    DriveRate r;
    m.drive(i).time_derivative(references[k], x[i], x[n + i], m.drive_states(x, i), r);
    for (int c = 0; c < m.drive(i).state_count(); ++c) rate[m.z_begin[k] + c] += r.zdot[c];
    if (i >= m.arm) {
      rate[n + i] += r.torque;
    } else if (r.torque != 0.0) {
      for (int j = 0; j < m.arm; ++j) rate[n + j] += G(j, i) * r.torque;
    }
  }
}

}  // namespace takt
