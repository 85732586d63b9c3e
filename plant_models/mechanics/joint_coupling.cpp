#include "plant_models/mechanics/joint_coupling.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

namespace takt {

JointCoupling::JointCoupling(int joint_count, const std::vector<MimicJoint>& mimics)
    : joint_count_(joint_count) {
  if (joint_count < 0 || joint_count > kMaxJoints)
    throw std::invalid_argument("coupled joints: a tree has at most " + std::to_string(kMaxJoints) +
                                " joints, not " + std::to_string(joint_count));
  std::array<const MimicJoint*, kMaxJoints> follows{};
  for (const MimicJoint& mimic : mimics) {
    const std::string who = "coupled joints: joint number " + std::to_string(mimic.joint + 1);
    if (mimic.joint < 0 || mimic.joint >= joint_count || mimic.source < 0 || mimic.source >= joint_count)
      throw std::invalid_argument(who + " follows number " + std::to_string(mimic.source + 1) +
                                  "; the tree has " + std::to_string(joint_count));
    if (!std::isfinite(mimic.multiplier) || !std::isfinite(mimic.offset))
      throw std::invalid_argument(who + ": its multiplier and offset must be finite");
    if (follows[static_cast<size_t>(mimic.joint)] != nullptr)
      throw std::invalid_argument(who + " follows two joints");
    follows[static_cast<size_t>(mimic.joint)] = &mimic;
  }
  std::array<int, kMaxJoints> coordinate{};
  for (int i = 0; i < joint_count; ++i) {
    if (follows[static_cast<size_t>(i)] != nullptr) continue;
    coordinate[static_cast<size_t>(i)] = independent_count();
    independent_.push_back(i);
  }
  for (int i = 0; i < joint_count; ++i) {
    Row row;
    int at = i;
    for (int steps = 0; const MimicJoint* mimic = follows[static_cast<size_t>(at)]; ++steps) {
      if (steps == joint_count)
        throw std::invalid_argument("coupled joints: joint number " + std::to_string(i + 1) +
                                    " follows joints that follow each other in a ring");
      row.offset += row.multiplier * mimic->offset;
      row.multiplier *= mimic->multiplier;
      at = mimic->source;
    }
    row.coordinate = coordinate[static_cast<size_t>(at)];
    rows_[static_cast<size_t>(i)] = row;
  }
}

void JointCoupling::positions(const double* y, double* q) const {
  for (int i = 0; i < joint_count_; ++i) {
    const Row& row = rows_[static_cast<size_t>(i)];
    q[i] = row.multiplier * y[row.coordinate] + row.offset;
  }
}

void JointCoupling::rates(const double* yd, double* qd) const {
  for (int i = 0; i < joint_count_; ++i) {
    const Row& row = rows_[static_cast<size_t>(i)];
    qd[i] = row.multiplier * yd[row.coordinate];
  }
}

void JointCoupling::forces(const double* tau, double* tau_y) const {
  for (int k = 0; k < independent_count(); ++k) tau_y[k] = 0.0;
  for (int i = 0; i < joint_count_; ++i) {
    const Row& row = rows_[static_cast<size_t>(i)];
    tau_y[row.coordinate] += row.multiplier * tau[i];
  }
}

void JointCoupling::inverse_dynamics(const MultibodyTree& tree, const double* ydd, double* tau_y,
                                     MultibodyTree::Workspace& w) const {
  JointArray qdd, tau;
  rates(ydd, qdd.data());
  tree.inverse_dynamics(qdd.data(), tau.data(), w);
  forces(tau.data(), tau_y);
}

void JointCoupling::forward_dynamics(const MultibodyTree& tree, const double* tau_y,
                                     const MultibodyTree::Mask& locked, double* ydd, double* tau_lock,
                                     MultibodyTree::Workspace& w) const {
  const int n = independent_count();
  JointArray bias;
  const JointArray still{};
  inverse_dynamics(tree, still.data(), bias.data(), w);
  MultibodyTree::MassMatrix M_q, M = MultibodyTree::MassMatrix::Zero(n, n);
  tree.mass_matrix(M_q, w);
  for (int i = 0; i < joint_count_; ++i) {
    const Row& a = rows_[static_cast<size_t>(i)];
    for (int j = 0; j < joint_count_; ++j) {
      const Row& b = rows_[static_cast<size_t>(j)];
      M(a.coordinate, b.coordinate) += a.multiplier * b.multiplier * M_q(i, j);
    }
  }
  using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxJoints, 1>;
  Column force(n);
  for (int k = 0; k < n; ++k) force(k) = tau_y[k] - bias[static_cast<size_t>(k)];
  MultibodyTree::MassMatrix free = M;
  Column right = force;
  for (int k = 0; k < n; ++k) {
    if (!locked[static_cast<size_t>(k)]) continue;
    free.row(k).setZero();
    free.col(k).setZero();
    free(k, k) = 1.0;
    right(k) = 0.0;
  }
  const Column solution = free.llt().solve(right);
  const Column inertial = M * solution;
  for (int k = 0; k < n; ++k) {
    const bool held = locked[static_cast<size_t>(k)];
    ydd[k] = held ? 0.0 : solution(k);
    tau_lock[k] = held ? inertial(k) - force(k) : 0.0;
  }
  JointArray reached;
  inverse_dynamics(tree, ydd, reached.data(), w);  // for the reactions
}

}  // namespace takt
