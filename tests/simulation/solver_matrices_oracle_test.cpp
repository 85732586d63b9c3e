// The linear algebra of the solvers against Eigen's dense one.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "plant_models/mechanics/rigid_body.h"
#include "server/simulation/solver/block_lu.h"
#include "server/simulation/solver/sparse_lu.h"
#include "server/simulation/solver/system_jacobian.h"
#include "tests/support/box_cell.h"

namespace takt::test {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

TEST(SparseLu, RandomSparseSystemsHaveTheDenseSolution) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  for (int round = 0; round < 200; ++round) {
    const int n = 1 + round % 40;
    std::vector<std::pair<int, int>> pattern;
    for (int i = 0; i < 3 * n; ++i)
      pattern.emplace_back(static_cast<int>(random() % static_cast<unsigned>(n)),
                           static_cast<int>(random() % static_cast<unsigned>(n)));  // some of them twice
    SparseLu lu(n, pattern);
    for (int use = 0; use < 3; ++use) {
      std::vector<double> values(pattern.size());
      Matrix A = Matrix::Zero(n, n);
      for (std::size_t e = 0; e < pattern.size(); ++e)
        A(pattern[e].first, pattern[e].second) += values[e] = value(random);
      const double s = 0.1;
      ASSERT_TRUE(lu.factorise(s, values));
      Vector b = Vector::NullaryExpr(n, [&] { return value(random); });
      const Vector expected = (Matrix::Identity(n, n) - s * A).partialPivLu().solve(b);
      lu.solve({b.data(), static_cast<std::size_t>(n)});
      EXPECT_LE((b - expected).norm(), 1e-12 * (1.0 + expected.norm())) << n;
    }
  }
}

TEST(SparseLu, AStarHasNoFillWhenItsCentreGoesLast) {
  // Drives on one arm: each talks to the arm's state only.
  std::vector<std::pair<int, int>> pattern;
  for (int i = 1; i < 20; ++i) pattern.insert(pattern.end(), {{0, i}, {i, 0}, {i, i}});
  EXPECT_EQ(SparseLu(20, pattern).fill(), 20U + 2U * 19U);
}

TEST(SparseLu, SingularMatricesAreRefused) {
  const std::vector<std::pair<int, int>> pattern{{0, 0}, {0, 1}, {1, 0}, {1, 1}};
  SparseLu lu(2, pattern);
  const double singular[] = {1.0, 0.0, 0.0, 0.5}, dependent[] = {0.5, 0.5, 0.5, 0.5};
  EXPECT_FALSE(lu.factorise(1.0, singular));
  EXPECT_FALSE(lu.factorise(1.0, dependent));
  EXPECT_TRUE(lu.factorise(0.5, singular));
}

/// Nodes of 1 to 9 unknowns, in any order on the right side, and couplings between them, some of them twice.
struct BlockPattern {
  BlockPattern(std::size_t count, std::mt19937& random) {
    for (std::size_t i = 0; i < count; ++i) {
      nodes.push_back({static_cast<std::size_t>(unknowns), i % 3 == 0 ? 1 + random() % 9 : 6});
      unknowns += static_cast<Eigen::Index>(nodes.back().size);
    }
    const auto any = [&] { return static_cast<int>(random() % static_cast<unsigned>(count)); };
    for (std::size_t i = 0; i < 2 * count; ++i) couplings.emplace_back(any(), any());
  }
  std::vector<BlockLu::Node> nodes;
  std::vector<std::pair<int, int>> couplings;
  Eigen::Index unknowns = 0;
};

TEST(BlockLu, RandomSystemsHaveTheDenseSolution) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  BlockLu lu;
  for (int round = 0; round < 100; ++round) {
    const BlockPattern pattern(1 + static_cast<std::size_t>(round) % 30, random);
    const Eigen::Index n = pattern.unknowns;
    lu.set_pattern(pattern.nodes, pattern.couplings);
    for (int use = 0; use < 2; ++use) {
      Matrix A = Matrix::Zero(n, n);
      lu.clear();
      const auto fill = [&](int row, int column, double dominance) {
        const auto &r = pattern.nodes[static_cast<std::size_t>(row)],
                   &c = pattern.nodes[static_cast<std::size_t>(column)];
        const auto rows = static_cast<Eigen::Index>(r.size), columns = static_cast<Eigen::Index>(c.size);
        Matrix block = Matrix::NullaryExpr(rows, columns, [&] { return value(random); });
        // Rows in another order: exchanges are needed.
        if (row == column) block += dominance * Matrix::Identity(rows, rows).rowwise().reverse();
        A.block(static_cast<Eigen::Index>(r.first), static_cast<Eigen::Index>(c.first), rows, columns) +=
            block;
        Eigen::Map<Matrix>(lu.block(row, column), rows, columns) += block;
      };
      for (std::size_t i = 0; i < pattern.nodes.size(); ++i)
        fill(static_cast<int>(i), static_cast<int>(i), 40.0);
      for (const auto& [one, other] : pattern.couplings)
        if (one != other) fill(one, other, 0.0), fill(other, one, 0.0);
      // A row of a servo: its own unknown alone.
      const auto& servo = pattern.nodes[pattern.nodes.size() / 2];
      const auto row = static_cast<Eigen::Index>(servo.first);
      A.row(row).setZero();
      A(row, row) = 3.0;
      lu.clear_row(static_cast<int>(pattern.nodes.size() / 2), 0);
      *lu.block(static_cast<int>(pattern.nodes.size() / 2), static_cast<int>(pattern.nodes.size() / 2)) = 3.0;
      Vector b = Vector::NullaryExpr(n, [&] { return value(random); });
      const auto dense = A.fullPivLu();
      if (!dense.isInvertible()) continue;
      ASSERT_TRUE(lu.factorise());
      const Vector expected = dense.solve(b);
      lu.solve(b.data());
      EXPECT_LE((b - expected).norm(), 1e-10 * (1.0 + expected.norm())) << round;
    }
  }
}

TEST(BlockLu, ChainsAndStarsHaveNoFill) {
  std::vector<BlockLu::Node> nodes;
  std::vector<std::pair<int, int>> chain, star;
  for (int i = 0; i < 20; ++i) {
    nodes.push_back({6 * static_cast<std::size_t>(i), 6});
    if (i > 0) chain.emplace_back(i - 1, i), star.emplace_back(0, i);
  }
  BlockLu lu;
  for (const auto& couplings : {chain, star}) {
    lu.set_pattern(nodes, couplings);
    EXPECT_EQ(lu.fill(), 20U + 2U * 19U);
  }
}

TEST(BlockLu, SingularBlocksAreRefused) {
  const std::vector<BlockLu::Node> nodes{{0, 1}, {1, 1}};
  const std::vector<std::pair<int, int>> couplings{{0, 1}};
  BlockLu lu;
  lu.set_pattern(nodes, couplings);
  for (const double last : {1.0, 2.0, std::nan("")}) {
    lu.clear();
    *lu.block(0, 0) = *lu.block(0, 1) = *lu.block(1, 0) = 1.0;
    *lu.block(1, 1) = last;
    EXPECT_EQ(lu.factorise(), last == 2.0);
  }
}

TEST(SystemJacobian, TheBlocksEqualThoseOfTheDenseMatrix) {
  // Two groups, of two and of three Parts that hold each other in the air, and one Part alone.
  BoxCell cell;
  for (const double x : {0.0, 1.0}) {
    const std::string name = x > 0.0 ? "R" : "L";
    cell.part(name + "B", 1.0, 4, {0.2, 0.1, 0.06}, at(x, 0, 3.0));
    cell.part(name + "P", 0.3, 2, {0.03, 0.03, 0.08}, at(x + 0.05, 0.01, 3.06));
  }
  cell.part("RC", 5.0, 3, {0.06, 0.08, 0.08}, at(0.94, 0, 3.06));
  cell.part("alone", 1.0, 3, {0.06, 0.08, 0.08}, at(5.0, 0, 3.0));
  const auto model = cell.build();
  ComponentInteraction interaction(model->components, model->pairs, model->interaction);
  std::vector<RigidBody> bodies(model->parts.begin(), model->parts.end());
  std::vector<PlantModel*> models;
  for (RigidBody& body : bodies) models.push_back(&body);
  OdeSystem system(models, interaction, bodies.size(), 0);
  const auto n = static_cast<std::size_t>(system.state_count());
  std::vector<double> x(n);
  system.initial_state(x);
  system.update_motion(0.0, x);
  interaction.update_poses(system.motion(), nullptr);
  interaction.update_connections(system.motion(), {}, nullptr);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> small(-1e-3, 1e-3), unit(-1.0, 1.0);
  for (double& value : x) value += small(random);

  const SystemJacobian::Derivatives f = [&](double t, const double* at, double* xdot) {
    system.derivatives(t, {at, n}, {xdot, n});
    return true;
  };
  SystemJacobian jacobian(system);
  jacobian.find_groups(system, 0.0, x.data(), f);
  EXPECT_EQ(jacobian.group_count(), 3U);
  EXPECT_EQ(jacobian.columns(), 39U);
  std::vector<double> f0(n);
  f(0.0, x.data(), f0.data());
  ASSERT_TRUE(jacobian.evaluate(0.0, x.data(), f0.data(), f));
  const double a = 2.0, b = 1e-3;
  ASSERT_TRUE(jacobian.factorise(a, b));

  Matrix dense(n, n);  // central differences, one state at a time
  std::vector<double> up(n), down(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double keep = x[i], h = 1e-6;
    x[i] = keep + h, f(0.0, x.data(), up.data());
    x[i] = keep - h, f(0.0, x.data(), down.data());
    x[i] = keep;
    for (std::size_t k = 0; k < n; ++k)
      dense(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) = (up[k] - down[k]) / (2.0 * h);
  }
  Vector v = Vector::NullaryExpr(static_cast<Eigen::Index>(n), [&] { return unit(random); });
  const auto size = static_cast<Eigen::Index>(n);
  const Vector expected = (a * Matrix::Identity(size, size) - b * dense).partialPivLu().solve(v);
  jacobian.solve(v.data());
  EXPECT_LE((v - expected).norm(), 1e-5 * expected.norm());
}

}  // namespace
}  // namespace takt::test
