#pragma once
// A random cell under any of the interaction algorithms. In chains of Parts of very different size, the modes
// are many times faster than those of single connections; softer springs let tests step through them in
// bounded time, and the step follows from the fastest of these modes.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "server/contact/holding/connections.h"
#include "tests/support/random_assembly.h"

namespace takt::test {

inline constexpr double kSoftError_m = 1e-3;           ///< static position error that the weight causes
inline constexpr double kLongestChainStep_s = 2.5e-5;  ///< enough for most assemblies of RandomCell

inline std::shared_ptr<CellModel> under_algorithm(const RandomCell& cell, InteractionAlgorithm algorithm,
                                                  double step_s = kLongestChainStep_s) {
  auto model = std::make_shared<CellModel>(*cell.model());
  model->interaction.algorithm = algorithm;
  model->step_s = model->description.step_s = step_s;
  for (const int part : cell.parts) {
    Component& c = model->components[static_cast<std::size_t>(part)];
    c.substitute = substitute_parameters(c.mass_kg, c.I_BBcm_B, 9.80665, kSoftError_m, 1.0);
  }
  return model;
}

/// An upper bound (1/s) of the eigenvalues of M^-1 D, with the dampers D of all connections and the inertia M of the Parts.
/// With critically damped springs no mode is faster, and the explicit method of second order is stable up to a step of
/// 2 / bound. With D = B^T B the eigenvalues are those of B M^-1 B^T; its blocks belong to pairs of connections, and the
/// bound is its largest sum of a row's norms.
inline double bound_of_damping_per_s(const CellModel& model, const Snapshot& s,
                                     std::span<const PairConnection> connections) {
  struct Damper {
    int body[2];     // Base, Target
    double rate[2];  // 1/s: of the damper alone on this body, the other fixed
  };
  const auto component = [&](int id) -> const Component& {
    return model.components[static_cast<std::size_t>(id)];
  };
  const auto smallest_inertia = [&](int id) {
    return Eigen::SelfAdjointEigenSolver<Mat3>(component(id).I_BBcm_B, Eigen::EigenvaluesOnly)
        .eigenvalues()
        .minCoeff();
  };
  const auto center = [&](int id) {
    const ComponentSample& c = s.components[static_cast<std::size_t>(id)];
    return Vec3(c.p_WB + c.q_WB * component(id).p_BBcm);
  };
  std::vector<Damper> dampers;
  for (const PairConnection& pair : connections) {
    const SubstituteParameters& gains = pair.connection.gains;
    const int target = pair.connection.partner;
    const double turning = gains.D_rot_B.norm();
    Damper damper{{pair.base, target}, {0.0, 0.0}};
    damper.rate[0] =
        gains.d_tr_N_s_per_m / component(pair.base).mass_kg + turning / smallest_inertia(pair.base);
    if (component(target).type == ComponentType::part) {
      const double arm2 = (center(pair.base) - center(target)).squaredNorm();
      damper.rate[1] = gains.d_tr_N_s_per_m / component(target).mass_kg +
                       (gains.d_tr_N_s_per_m * arm2 + turning) / smallest_inertia(target);
    }
    dampers.push_back(damper);
  }
  double bound = 0.0;
  for (const Damper& row : dampers) {
    double sum = row.rate[0] + row.rate[1];
    for (const Damper& other : dampers)
      for (int i = 0; i < 2 && &row != &other; ++i)
        for (int k = 0; k < 2; ++k)
          if (row.body[i] == other.body[k]) sum += std::sqrt(row.rate[i] * other.rate[k]);
    bound = std::max(bound, sum);
  }
  return bound;
}

}  // namespace takt::test
