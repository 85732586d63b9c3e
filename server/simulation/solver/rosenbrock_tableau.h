#pragma once
// ROS34PW2: J. Rang, L. Angermann, New Rosenbrock W-methods of order 3 for partial differential algebraic
// equations of index 1, BIT 45, 2005. Four stages, order 3 with an embedded method of order 2, both for any
// matrix A in place of the Jacobian; L-stable and stiffly accurate with the Jacobian itself.
//   (I - g h A) k_i = f(t + alpha_i h, x + h sum alpha_ij k_j) + h A sum_{j<i} gamma_ij k_j + h gamma_i f_t
//   x(t + h) = x + h sum b_i k_i
#include <array>

namespace takt {

struct RosenbrockTableau {
  static constexpr int kStages = 4;
  using Row = std::array<double, kStages>;
  using Square = std::array<Row, kStages>;

  double gamma = 4.3586652150845900e-01;
  Square alpha{
      {{}, {8.7173304301691801e-01}, {8.4457060015369423e-01, -1.1299064236484185e-01}, {0.0, 0.0, 1.0}}};
  /// Without the diagonal.
  Square gammas{{{},
                 {-8.7173304301691801e-01},
                 {-9.0338057013044082e-01, 5.4180672388095326e-02},
                 {2.4212380706095346e-01, -1.2232505839045147e+00, 5.4526025533510214e-01}}};
  Row b{2.4212380706095346e-01, -1.2232505839045147e+00, 1.5452602553351020e+00, 4.3586652150845900e-01};
  Row b_hat{3.7810903145819369e-01, -9.6042292212423178e-02, 5.0000000000000000e-01, 2.1793326075422950e-01};
};

/// The same in terms of u_i = h sum_j gamma_ij k_j (the diagonal included), which saves the products with A
/// (Hairer, Wanner, Solving Ordinary Differential Equations II, IV.7):
///   (I / (g h) - A) u_i = f(t + alpha_i h, x + sum a_ij u_j) + sum c_ij / h u_j + h gamma_i f_t
///   x(t + h) = x + sum m_i u_i, error estimate sum e_i u_i
struct RosenbrockForm {
  static constexpr int kStages = RosenbrockTableau::kStages;
  double gamma = 0.0;
  RosenbrockTableau::Square a{}, c{};
  RosenbrockTableau::Row alpha{}, gammas{}, m{}, e{};
};

constexpr RosenbrockForm transformed(const RosenbrockTableau& t) {
  constexpr int n = RosenbrockTableau::kStages;
  using Row = RosenbrockTableau::Row;
  const auto at = [](auto& square, int i, int j) -> auto& {
    return square[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  };
  // Inverse of the lower triangular matrix of all gamma_ij.
  RosenbrockTableau::Square inverse{};
  for (int j = 0; j < n; ++j) {
    at(inverse, j, j) = 1.0 / t.gamma;
    for (int i = j + 1; i < n; ++i) {
      double sum = 0.0;
      for (int k = j; k < i; ++k) sum += at(t.gammas, i, k) * at(inverse, k, j);
      at(inverse, i, j) = -sum / t.gamma;
    }
  }
  const auto times_inverse = [&](const Row& row) {
    Row result{};
    for (int j = 0; j < n; ++j)
      for (int k = j; k < n; ++k)
        result[static_cast<std::size_t>(j)] += row[static_cast<std::size_t>(k)] * at(inverse, k, j);
    return result;
  };
  RosenbrockForm form;
  form.gamma = t.gamma;
  form.m = times_inverse(t.b);
  const Row m_hat = times_inverse(t.b_hat);
  for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
    form.a[i] = times_inverse(t.alpha[i]);
    form.gammas[i] = t.gamma;
    for (std::size_t j = 0; j < i; ++j) {
      form.c[i][j] = -inverse[i][j];
      form.alpha[i] += t.alpha[i][j];
      form.gammas[i] += t.gammas[i][j];
    }
    form.e[i] = form.m[i] - m_hat[i];
  }
  return form;
}

}  // namespace takt
