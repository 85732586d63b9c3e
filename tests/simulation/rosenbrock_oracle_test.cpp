// The Rosenbrock W-method and the coupled linearly implicit one: coefficients by the order conditions, order
// in cells, stiff chains in large steps.
#include "server/simulation/solver/rosenbrock_integrator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "plant_models/mechanics/rigid_body.h"
#include "server/simulation/solver/rosenbrock_tableau.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"
#include "tests/support/ode_models.h"
#include "tests/support/ur10e_cell.h"

namespace takt::test {
namespace {

using Row = RosenbrockTableau::Row;

// Hairer, Wanner II, IV.7: with beta = alpha + gamma. A W-method of order 3 needs the conditions for every
// tree with alpha or gamma at each inner place.
void expect_order(const RosenbrockTableau& t, const Row& b, int order) {
  constexpr std::size_t n = RosenbrockTableau::kStages;
  const auto alpha = [&](std::size_t i, std::size_t j) { return t.alpha[i][j]; };
  const auto gamma = [&](std::size_t i, std::size_t j) { return i == j ? t.gamma : t.gammas[i][j]; };
  Row a{}, g{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) a[i] += alpha(i, j), g[i] += gamma(i, j);
  double sums[12] = {};
  for (std::size_t i = 0; i < n; ++i) {
    sums[0] += b[i];
    sums[1] += b[i] * a[i];
    sums[2] += b[i] * g[i];
    sums[3] += b[i] * a[i] * a[i];
    for (std::size_t j = 0; j < n; ++j) {
      sums[4] += b[i] * alpha(i, j) * a[j];
      sums[5] += b[i] * alpha(i, j) * g[j];
      sums[6] += b[i] * gamma(i, j) * a[j];
      sums[7] += b[i] * gamma(i, j) * g[j];
    }
  }
  const double expected[] = {1.0, 0.5, 0.0, 1.0 / 3.0, 1.0 / 6.0, 0.0, 0.0, 0.0};
  const int count = order == 3 ? 8 : 3;
  for (int i = 0; i < count; ++i) EXPECT_NEAR(sums[i], expected[i], 1e-14) << "condition " << i;
}

TEST(Rosenbrock, CoefficientsMeetTheOrderConditionsForAnyMatrix) {
  constexpr RosenbrockTableau t;
  expect_order(t, t.b, 3);
  expect_order(t, t.b_hat, 2);
  // Stiffly accurate: the last row of alpha + gamma is b.
  for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(t.alpha[3][j] + t.gammas[3][j], t.b[j], 1e-14);
  EXPECT_EQ(t.gamma, t.b[3]);
  // gamma is the root of L-stable methods of order 3.
  EXPECT_NEAR(std::pow(t.gamma, 3) - 3.0 * std::pow(t.gamma, 2) + 1.5 * t.gamma - 1.0 / 6.0, 0.0, 1e-14);
}

// One step of x' = z x by the transformed method is that of the method as it is printed.
TEST(Rosenbrock, TheTransformedMethodGivesTheSameStep) {
  constexpr RosenbrockTableau t;
  constexpr RosenbrockForm form = transformed(t);
  for (const double z : {-0.3, -3.0, -200.0}) {
    for (const double A : {z, 0.5 * z, 0.0}) {
      Row k{}, u{};
      double printed = 1.0, printed_error = 0.0, transformed_x = 1.0, transformed_error = 0.0;
      for (std::size_t i = 0; i < 4; ++i) {
        double x = 1.0, y = 1.0, g = 0.0, c = 0.0;
        for (std::size_t j = 0; j < i; ++j) {
          x += t.alpha[i][j] * k[j], g += t.gammas[i][j] * k[j];
          y += form.a[i][j] * u[j], c += form.c[i][j] * u[j];
        }
        k[i] = (z * x + A * g) / (1.0 - t.gamma * A);
        u[i] = (z * y + c) / (1.0 / form.gamma - A);
        printed += t.b[i] * k[i], printed_error += (t.b[i] - t.b_hat[i]) * k[i];
        transformed_x += form.m[i] * u[i], transformed_error += form.e[i] * u[i];
      }
      EXPECT_NEAR(transformed_x, printed, 1e-12 * (1.0 + std::abs(printed)));
      EXPECT_NEAR(transformed_error, printed_error, 1e-12 * (1.0 + std::abs(printed_error)));
      if (A == z && z < -100.0) {
        EXPECT_LT(std::abs(printed), 0.02) << "L-stable";
      }
    }
  }
  for (std::size_t i = 0; i < 4; ++i) {
    double alpha = 0.0, gamma = t.gamma;
    for (std::size_t j = 0; j < i; ++j) alpha += t.alpha[i][j], gamma += t.gammas[i][j];
    EXPECT_NEAR(form.alpha[i], alpha, 1e-15);
    EXPECT_NEAR(form.gammas[i], gamma, 1e-15);
  }
}

constexpr double kNoTolerance = 1e9;  // every step is good: as large as the communication step

double rosenbrock_order(NonlinearModel::Jacobian jacobian) {
  const auto error = [jacobian](double h) {
    NonlinearModel model(jacobian);
    LooseSystem loose({&model});
    const auto solver = loose.solver("rosenbrock", kNoTolerance);
    EXPECT_TRUE(loose.run(*solver, h, static_cast<int>(std::lround(2.0 / h)))) << solver->failure();
    EXPECT_NEAR(solver->statistics().largest_step_s, h, 1e-12);
    return NonlinearModel::error(2.0, loose.x);
  };
  return std::log2(error(0.02) / error(0.01));
}

TEST(Rosenbrock, TheOrderIsThreeWithAnyJacobian) {
  using Jacobian = NonlinearModel::Jacobian;
  for (const Jacobian jacobian : {Jacobian::none, Jacobian::zero, Jacobian::wrong, Jacobian::exact})
    EXPECT_NEAR(rosenbrock_order(jacobian), 3.0, 0.25) << static_cast<int>(jacobian);
}

TEST(Rosenbrock, StiffEquationsFollowTheirReferenceInLargeSteps) {
  StiffModel model(1e5, 1.0);
  LooseSystem loose({&model});
  const auto solver = loose.solver("rosenbrock", 1e-4);
  ASSERT_TRUE(loose.run(*solver, 0.1, 10)) << solver->failure();
  EXPECT_LT(std::abs(loose.x[0] - std::sin(1.0)), 1e-4);
  const SolverStatistics& s = solver->statistics();
  EXPECT_LT(s.steps, 100U);
  EXPECT_GE(s.largest_step_s, 0.05);
  EXPECT_GE(s.evaluations, 4 * s.steps);
  EXPECT_EQ(s.jacobians, s.steps);
  EXPECT_EQ(s.factorisations, s.steps + s.rejected_steps);
  EXPECT_EQ(s.forced_steps, 0U);
}

/// x' = -rate (x - acceleration t^2 / 2) without entries of the Jacobian. On its smooth solution a trial of ROS2 has the same
/// error wherever it begins, which neither the size nor the change of its difference from Euler's method shows.
class UnknownStiffness final : public FreeModel {
 public:
  static constexpr double kRate = 500.0, kAcceleration = 60.0;
  static double solution(double t) {
    return kAcceleration * (0.5 * t * t - t / kRate + 1.0 / (kRate * kRate));
  }
  int state_count() const override { return 1; }
  int absolute_states() const override { return 1; }
  void initial_state(double* x) const override { x[0] = solution(0.0); }
  void derivatives(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = -kRate * (x[0] - 0.5 * kAcceleration * t * t);
  }
};

TEST(Rosenbrock, CalmStepsHaveNoErrorThatEachTrialMakesAlike) {
  constexpr double kAllowed = 1e-4, kStep_s = 0.008;
  UnknownStiffness model;
  LooseSystem loose({&model});
  const auto solver = loose.solver("automatic", kAllowed);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(loose.run(*solver, kStep_s, 1, i)) << solver->failure();
    EXPECT_NEAR(loose.x[0], UnknownStiffness::solution(kStep_s * (i + 1)), kAllowed) << i;
  }
}

TEST(Rosenbrock, UniformlyAcceleratedMotionIsCalm) {
  constexpr double kPeriod_s = 0.008, kGravity = 9.80665;
  constexpr int kCount = 100;
  RigidBodyParameters box;
  box.body = 0, box.mass_kg = 1.0, box.gravity_W = Vec3(0.0, 0.0, -kGravity);
  RigidBody body(box);
  LooseSystem loose({&body}, 1);
  const auto solver = loose.solver("automatic", 1e-4);
  ASSERT_TRUE(loose.run(*solver, kPeriod_s, kCount)) << solver->failure();
  const double t = kPeriod_s * kCount;
  EXPECT_NEAR(loose.x[2], -0.5 * kGravity * t * t, 1e-12);
  // Nothing comes before the first step that it could be compared with.
  EXPECT_LE(solver->statistics().rejected_steps, 2U);
  EXPECT_LE(solver->statistics().jacobians, 30U);
}

TEST(Rosenbrock, ErrorsOfAbsoluteStatesDoNotGrowWithTheDistanceFromTheOrigin) {
  // The same throw of a spinning box beside the origin and 100 m away, at 50 m/s.
  const auto run = [](const Vec3& place, const Vec3& speed) {
    RigidBodyParameters box;
    box.body = 0, box.mass_kg = 1.0;
    box.I_BBcm_B = Vec3(1e-3, 2e-3, 2.5e-3).asDiagonal();
    RigidBody body(box);
    LooseSystem loose({&body}, 1);
    const double state[] = {place.x(), place.y(), place.z(), 1, 0,   0, 0,
                            speed.x(), speed.y(), speed.z(), 9, 0.2, 7};
    std::copy(std::begin(state), std::end(state), loose.x.begin());
    const auto solver = loose.solver("rosenbrock", 1e-4);
    EXPECT_TRUE(loose.run(*solver, 0.1, 10)) << solver->failure();
    return solver->statistics().steps;
  };
  EXPECT_EQ(run(Vec3::Zero(), Vec3::Zero()), run(Vec3(100, -100, 100), Vec3(50, 0, -50)));
}

/// Parts that hold each other, spinning: moving connections under load.
struct SpinningParts {
  explicit SpinningParts(double allowed_error_m, InteractionAlgorithm algorithm, int count) {
    BoxCell cell;
    cell.gravity(Vec3::Zero());
    cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0), allowed_error_m);
    cell.part("P", 0.3, 3, {0.03, 0.03, 0.08}, at(0.05, 0.01, 0.06), allowed_error_m);
    if (count > 2) cell.part("Q", 0.1, 2, {0.03, 0.03, 0.05}, at(0.05, 0.01, 0.14), allowed_error_m);
    cell.model().interaction.algorithm = algorithm;
    model = cell.build();
    interaction.emplace(model->components, model->pairs, model->interaction);
    for (const RigidBodyParameters& part : model->parts) bodies.emplace_back(part);
    std::vector<PlantModel*> models;
    for (RigidBody& body : bodies) models.push_back(&body);
    system.emplace(models, *interaction, bodies.size(), 0);
    x.resize(static_cast<std::size_t>(system->state_count()));
    system->initial_state(x);
    const Vec3 w(0.6, -0.4, 2.0);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      double* s = x.data() + 13 * i;
      const Vec3 v = w.cross(Vec3(s[0], s[1], s[2]));
      for (int k = 0; k < 3; ++k) s[7 + k] = v[k], s[10 + k] = w[k];
    }
    system->update_motion(0.0, x);
    interaction->update_poses(system->motion(), nullptr);
    interaction->update_connections(system->motion(), {}, nullptr);
    x[7] += 0.05;  // and a blow
  }
  bool run(const SolverParameters& parameters, double h, double end) {
    const auto solver = make_integrator(parameters, *system);
    const int steps = static_cast<int>(std::lround(end / h));
    for (int i = 0; i < steps; ++i) {
      system->update_motion(h * i, x);
      if (!solver->advance(*system, h * i, h, x)) return false;
    }
    statistics = solver->statistics();
    return true;
  }
  std::shared_ptr<const CellModel> model;
  std::optional<ComponentInteraction> interaction;
  std::vector<RigidBody> bodies;
  std::optional<OdeSystem> system;
  std::vector<double> x;
  SolverStatistics statistics;
};

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double d = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (const double each = std::abs(a[i] - b[i]); !(each <= d)) d = each;
  return d;
}

double order_on_parts(const std::string& name, double h) {
  const auto state = [&](const SolverParameters& parameters, double step) {
    SpinningParts parts(1e-2, InteractionAlgorithm::partner_search, 2);
    EXPECT_EQ(parts.interaction->connections().size(), 1U);
    EXPECT_TRUE(parts.run(parameters, step, 0.256));
    return parts.x;
  };
  const auto exact = state({"rk4", 0.0, 0.0}, 5e-5);
  const SolverParameters parameters{name, kNoTolerance, 0.0, SystemMatrix::coupled};
  return std::log2(largest_difference(state(parameters, h), exact) /
                   largest_difference(state(parameters, 0.5 * h), exact));
}

TEST(CoupledSolvers, TheOrderHoldsOnTwoConnectedParts) {
  EXPECT_NEAR(order_on_parts("rosenbrock", 0.004), 3.0, 0.3);
  EXPECT_NEAR(order_on_parts("implicit", 0.004), 2.0, 0.3);
}

double order_on_arm(const std::string& name, double h) {
  const auto state = [](const SolverParameters& parameters, double step) {
    Ur10eCell cell(simplified_drive);
    JointArray q = ready_position(), qd{};
    for (std::size_t i = 0; i < 6; ++i) q[i] += 0.1, qd[i] = 0.5;
    cell.reference.set_point(0.0, 0.256, q.data(), qd.data());
    std::vector<Component> components(3);
    ComponentPairs pairs;
    const ComponentInteraction interaction(components, pairs, {});
    OdeSystem system({cell.robot.get()}, interaction, 3, 1);
    std::vector<double> x(static_cast<std::size_t>(system.state_count()));
    system.initial_state(x);
    const auto solver = make_integrator(parameters, system);
    for (int i = 0; i < static_cast<int>(std::lround(0.128 / step)); ++i) {
      system.update_motion(step * i, x);
      EXPECT_TRUE(solver->advance(system, step * i, step, x));
    }
    x.resize(16);  // positions and velocities
    return x;
  };
  const auto exact = state({"rk4", 0.0, 0.0}, 2e-5);
  const SolverParameters parameters{name, kNoTolerance, 0.0, SystemMatrix::coupled};
  return std::log2(largest_difference(state(parameters, h), exact) /
                   largest_difference(state(parameters, 0.5 * h), exact));
}

TEST(CoupledSolvers, TheOrderHoldsOnASwingingArm) {
  EXPECT_GT(order_on_arm("rosenbrock", 0.002), 2.9);  // the leading error is small here
  EXPECT_NEAR(order_on_arm("implicit", 0.001), 2.0, 0.4);
}

TEST(CoupledSolvers, StiffChainsAreSolvedInLargeSteps) {
  constexpr double kEnd = 0.512, kLarge = 0.008;
  const auto algorithm = InteractionAlgorithm::extended_substitute_force;
  SpinningParts exact(1e-5, algorithm, 3), adaptive(1e-5, algorithm, 3), fixed(1e-5, algorithm, 3),
      separate(1e-5, algorithm, 3), explicit_one(1e-5, algorithm, 3);
  ASSERT_EQ(exact.interaction->connections().size(), 2U);
  ASSERT_TRUE(exact.run({"rk4", 0.0, 0.0}, 2e-5, kEnd));
  ASSERT_TRUE(adaptive.run({"rosenbrock", 1e-4, 0.0}, kLarge, kEnd));
  EXPECT_LT(largest_difference(adaptive.x, exact.x), 2e-3);
  // The fastest mode, 990 1/s, leaves explicit methods 2 ms.
  EXPECT_GE(adaptive.statistics.largest_step_s, 0.004);
  EXPECT_LT(adaptive.statistics.steps, 300U);
  ASSERT_TRUE(fixed.run({"implicit", 0.0, 0.0, SystemMatrix::coupled}, 0.004, kEnd));
  EXPECT_LT(largest_difference(fixed.x, exact.x), 2e-2);
  static_cast<void>(explicit_one.run({"rk2", 0.0, 0.0}, 0.004, kEnd));
  EXPECT_FALSE(largest_difference(explicit_one.x, exact.x) < 1.0);
  // Nor does it help to be implicit inside models only.
  static_cast<void>(separate.run({"implicit", 0.0, 0.0, SystemMatrix::separate}, 0.004, kEnd));
  EXPECT_FALSE(largest_difference(separate.x, exact.x) < 1.0);
}

TEST(CoupledSolvers, NewtonConvergesWithTheCoupledMatrix) {
  const auto algorithm = InteractionAlgorithm::extended_substitute_force;
  SpinningParts exact(1e-4, algorithm, 3);
  ASSERT_TRUE(exact.run({"rk4", 0.0, 0.0}, 2e-5, 0.256));
  for (const char* name : {"cvode", "esdirk", "esdirk4", "ida"}) {
    SpinningParts parts(1e-4, algorithm, 3);
    ASSERT_TRUE(parts.run({name, 1e-8, 0.0, SystemMatrix::coupled}, 0.008, 0.256)) << name;
    EXPECT_LT(largest_difference(parts.x, exact.x), 1e-5) << name;
    EXPECT_GT(parts.statistics.jacobians, 0U);
    // No finite differences: one evaluation per Jacobian.
    EXPECT_LT(parts.statistics.evaluations,
              8 * parts.statistics.newton_iterations + parts.statistics.jacobians + 100)
        << name;
  }
}

TEST(Rosenbrock, ChangesOfModesAreLocated) {
  BouncingModel ball;
  LooseSystem loose({&ball});
  const auto solver = loose.solver("rosenbrock", 1e-6);
  ASSERT_TRUE(loose.run(*solver, 0.01, 150)) << solver->failure();
  ASSERT_EQ(ball.bounces.size(), 3U);
  for (int k = 0; k < 3; ++k) {
    const double late = ball.bounces[static_cast<std::size_t>(k)] - BouncingModel::bounce_time(k);
    EXPECT_GT(late, -1e-4 * k) << k;
    EXPECT_LT(late, 2e-5 + 1e-4 * k) << k;  // each shifts the next ones
  }
  EXPECT_GE(solver->statistics().mode_switches, 6U);

  StickSlipModel mass;
  LooseSystem sliding({&mass});
  const auto second = sliding.solver("rosenbrock", 1e-6);
  ASSERT_TRUE(sliding.run(*second, 0.008, 275)) << second->failure();
  ASSERT_GE(mass.switches.size(), 2U);
  EXPECT_NEAR(mass.switches[0], StickSlipModel::break_away_time(), 2e-5);
}

TEST(Rosenbrock, ModesThatNeverSettleHaveABoundedCost) {
  RestlessModel model;
  LooseSystem loose({&model});
  const auto solver = loose.solver("rosenbrock");
  EXPECT_TRUE(loose.run(*solver, 0.01, 2)) << solver->failure();
  EXPECT_LT(solver->statistics().steps, 2U * 10'001U);
}

/// A force that a step of any size misjudges: it has the sign of rounding.
class NoiseModel final : public FreeModel {
 public:
  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = 0.0; }
  void derivatives(double t, const double*, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = 1e4 * std::sin(1e9 * t);
  }
};

TEST(Rosenbrock, BelowTheSmallestStepEveryErrorIsAccepted) {
  NoiseModel model;
  LooseSystem loose({&model});
  const auto solver = loose.solver("rosenbrock", 1e-6);
  ASSERT_TRUE(loose.run(*solver, 1e-3, 2)) << solver->failure();
  EXPECT_GT(solver->statistics().forced_steps, 100U);
  EXPECT_LT(solver->statistics().steps, 2U * 1100U);
  EXPECT_TRUE(std::isfinite(loose.x[0]));
}

/// x' = -sqrt(x - edge): not a number beyond the edge.
class CliffModel final : public FreeModel {
 public:
  explicit CliffModel(double edge) : edge_(edge) {}
  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = 1.0; }
  void derivatives(double, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = -std::sqrt(x[0] - edge_);  // reaches the edge with no speed
  }

 private:
  double edge_;
};

TEST(Rosenbrock, NonFiniteDerivativesCostStepsOrEndWithAReason) {
  // x - edge = (1 - t / 2)^2 up to t = 2.
  CliffModel model(0.0);
  LooseSystem loose({&model});
  const auto solver = loose.solver("rosenbrock", 1e-6);
  ASSERT_TRUE(loose.run(*solver, 0.19, 10)) << solver->failure();
  EXPECT_NEAR(loose.x[0], 0.0025, 1e-4);
  CliffModel beyond(1.5);
  LooseSystem bad({&beyond});
  const auto second = bad.solver("rosenbrock", 1e-6);
  EXPECT_FALSE(bad.run(*second, 0.1, 1));
  EXPECT_NE(second->failure().find("not finite at t = 0.0"), std::string::npos) << second->failure();
  EXPECT_EQ(bad.x[0], 1.0);
}

}  // namespace
}  // namespace takt::test
