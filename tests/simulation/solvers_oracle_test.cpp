// Solvers against closed forms: order of those with a fixed step, error against tolerance of the others, and
// invariants of rigid bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "plant_models/mechanics/rigid_body.h"
#include "tests/support/ode_models.h"

namespace takt::test {
namespace {

using Jacobian = NonlinearModel::Jacobian;

double nonlinear_error(const std::string& name, Jacobian jacobian, double h, double tolerance = 1e-6) {
  NonlinearModel model(jacobian);
  LooseSystem loose({&model});
  const auto solver = loose.solver(name, tolerance);
  EXPECT_TRUE(loose.run(*solver, h, static_cast<int>(std::lround(2.0 / h)))) << solver->failure();
  return NonlinearModel::error(2.0, loose.x);
}

double nonlinear_order(const std::string& name, Jacobian jacobian) {
  return std::log2(nonlinear_error(name, jacobian, 0.02) / nonlinear_error(name, jacobian, 0.01));
}

TEST(Solvers, TheOrderHoldsOnANonlinearEquation) {
  EXPECT_NEAR(nonlinear_order("rk2", Jacobian::none), 2.0, 0.1);
  EXPECT_NEAR(nonlinear_order("rk4", Jacobian::none), 4.0, 0.2);
}

TEST(Solvers, TheImplicitMethodKeepsItsOrderWithAnyJacobian) {
  for (const Jacobian jacobian : {Jacobian::none, Jacobian::zero, Jacobian::wrong, Jacobian::exact})
    EXPECT_NEAR(nonlinear_order("implicit", jacobian), 2.0, 0.15) << static_cast<int>(jacobian);
}

TEST(Solvers, TheImplicitMethodIsHeunsWithoutStiffness) {
  NonlinearModel model;
  LooseSystem a({&model}), b({&model});
  const auto implicit = a.solver("implicit"), heun = b.solver("rk2");
  ASSERT_TRUE(a.run(*implicit, 0.01, 200));
  ASSERT_TRUE(b.run(*heun, 0.01, 200));
  EXPECT_EQ(a.x, b.x);
}

/// A symmetric top without torque: its axis turns about the constant angular momentum L at the rate L / I1.
struct Top {
  RigidBodyParameters parameters;
  Vec3 spin{0.7, 0.0, 3.0};
  Top() {
    parameters.body = 0;
    parameters.mass_kg = 2.0;
    parameters.I_BBcm_B = Vec3(0.02, 0.02, 0.05).asDiagonal();
  }
  /// Largest error of axis, energy and momentum after one second.
  double error(const std::string& name, double h, double tolerance, bool conserved_only = false) const {
    RigidBody body(parameters);
    LooseSystem loose({&body}, 1);
    for (int i = 0; i < 3; ++i) loose.x[10 + static_cast<std::size_t>(i)] = spin[i];
    const Vec3 L = parameters.I_BBcm_B * spin;
    const double energy = mechanical_energy(parameters, loose.x.data());
    const auto solver = loose.solver(name, tolerance);
    EXPECT_TRUE(loose.run(*solver, h, static_cast<int>(std::lround(1.0 / h)))) << solver->failure();
    loose.system().update_motion(1.0, loose.x);
    const Mat3 R = loose.system().motion().bodies[0].X_WB.R;
    const Vec3 w(loose.x[10], loose.x[11], loose.x[12]);
    const Mat3 turn = Eigen::AngleAxisd(L.norm() / 0.02, L.normalized()).toRotationMatrix();
    const double conserved = std::max(std::abs(mechanical_energy(parameters, loose.x.data()) / energy - 1.0),
                                      (R * parameters.I_BBcm_B * R.transpose() * w - L).norm() / L.norm());
    return conserved_only ? conserved : std::max(conserved, (R.col(2) - turn.col(2)).norm());
  }
};

TEST(Solvers, TheOrderHoldsOnASpinningTop) {
  const Top top;
  const std::pair<const char*, double> orders[] = {{"rk2", 2.0}, {"implicit", 2.0}, {"rk4", 4.0}};
  for (const auto& [name, order] : orders) {
    const double coarse = top.error(name, 0.01, 0.0), fine = top.error(name, 0.005, 0.0);
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.25) << name << " " << coarse << " " << fine;
  }
}

TEST(Solvers, StiffEquationsDecayAtOnceAndFollowTheirReference) {
  StiffModel model(1e5, 1.0);  // 1e5 1/s at 1 ms: a hundred times beyond explicit methods
  LooseSystem loose({&model});
  const auto solver = loose.solver("implicit");
  ASSERT_TRUE(loose.run(*solver, 1e-3, 3));
  EXPECT_LT(std::abs(loose.x[0] - std::sin(3e-3)), 2e-4);  // 0.05^3
  ASSERT_TRUE(loose.run(*solver, 1e-3, 997, 3));
  EXPECT_LT(std::abs(loose.x[0] - std::sin(1.0)), 1e-6);
  EXPECT_EQ(solver->statistics().factorisations, 1000U);

  LooseSystem explicit_one({&model});
  const auto heun = explicit_one.solver("rk2");
  static_cast<void>(explicit_one.run(*heun, 1e-3, 50));
  EXPECT_FALSE(std::abs(explicit_one.x[0]) < 1e100);
}

TEST(Solvers, ErrorFallsWithTheTolerance) {
  for (const std::string& name : kErrorControlled) {
    double last = 1.0;
    for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
      const double error = nonlinear_error(name, Jacobian::none, 0.5, tolerance);
      EXPECT_LT(error, 100.0 * tolerance) << name;
      EXPECT_LT(error, 0.3 * last) << name << " " << tolerance;
      last = error;
    }
  }
}

/// Three states that never change.
class StillModel final : public FreeModel {
 public:
  int state_count() const override { return 3; }
  void initial_state(double* x) const override { std::fill_n(x, 3, 1.0); }
  void derivatives(double, const double*, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    std::fill_n(xdot, 3, 0.0);
  }
};

TEST(Solvers, OtherModelsDoNotLoosenTheTolerance) {
  for (const std::string& name : kErrorControlled) {
    NonlinearModel model;
    std::vector<StillModel> still(100);
    std::vector<PlantModel*> models{&model};
    for (StillModel& one : still) models.push_back(&one);
    LooseSystem alone({&model}), among(models);
    const auto first = alone.solver(name), second = among.solver(name);
    ASSERT_TRUE(alone.run(*first, 0.5, 4)) << name;
    ASSERT_TRUE(among.run(*second, 0.5, 4)) << name;
    EXPECT_EQ(first->statistics().steps, second->statistics().steps) << name;
    EXPECT_EQ(alone.x, std::vector<double>(among.x.begin(), among.x.begin() + 3)) << name;
  }
}

TEST(Solvers, ErrorControlTakesStiffEquationsInFewSteps) {
  for (const std::string& name : kAdaptive) {
    StiffModel model(1e5, 1.0);
    LooseSystem loose({&model});
    const auto solver = loose.solver(name, 1e-6);
    ASSERT_TRUE(loose.run(*solver, 0.1, 10)) << solver->failure();
    EXPECT_LT(std::abs(loose.x[0] - std::sin(1.0)), 1e-5) << name;
    const SolverStatistics& s = solver->statistics();
    EXPECT_LT(s.steps, 600U) << name;
    EXPECT_GT(s.evaluations, s.steps) << name;
    EXPECT_GT(s.jacobians, 0U) << name;
    EXPECT_GT(s.factorisations, 0U) << name;
    EXPECT_GT(s.newton_iterations, 0U) << name;
    EXPECT_EQ(s.restarts, 1U) << name;
    EXPECT_LT(s.smallest_step_s, 1e-4) << name;
    EXPECT_GT(s.largest_step_s, 1e-3) << name;
  }
}

TEST(Solvers, FreeFallIsExact) {
  for (const std::string_view view : solver_names()) {
    const std::string name(view);
    RigidBodyParameters parameters;
    parameters.body = 0;
    parameters.mass_kg = 2.0;
    parameters.gravity_W = Vec3(0.0, 0.0, -9.80665);
    RigidBody body(parameters);
    LooseSystem loose({&body}, 1);
    loose.x[7] = 1.0;
    const auto solver = loose.solver(name, 1e-8);
    ASSERT_TRUE(loose.run(*solver, 0.01, 50)) << solver->failure();
    const double allowed = solver_has_error_control(name) ? 1e-7 : 1e-12;
    EXPECT_NEAR(loose.x[0], 0.5, allowed) << name;
    EXPECT_NEAR(loose.x[2], -0.5 * 9.80665 * 0.25, allowed) << name;
    EXPECT_NEAR(loose.x[9], -9.80665 * 0.5, allowed) << name;
  }
}

TEST(Solvers, ASpinningTopKeepsEnergyAndMomentum) {
  const Top top;
  for (const std::string& name : kErrorControlled) {
    EXPECT_LT(top.error(name, 0.05, 1e-8), 1e-5) << name;
    EXPECT_LT(top.error(name, 0.05, 1e-10), 2e-7) << name;
    EXPECT_LT(top.error(name, 0.05, 1e-10, true), 2e-8) << name;
  }
  EXPECT_LT(top.error("rk4", 0.001, 0.0, true), 1e-11);
}

TEST(Solvers, RepeatedRunsGiveTheSameBits) {
  for (const std::string_view name : solver_names()) {
    std::vector<double> first;
    for (int run = 0; run < 2; ++run) {
      NonlinearModel model(Jacobian::wrong);
      StickSlipModel friction;
      LooseSystem loose({&model, &friction});
      const auto solver = loose.solver(std::string(name));
      ASSERT_TRUE(loose.run(*solver, 0.004, 500)) << solver->failure();
      if (run == 0) first = loose.x;
      EXPECT_EQ(loose.x, first) << name;
    }
  }
}

TEST(Solvers, AResetSolverEqualsANewOne) {
  for (const std::string_view name : solver_names()) {
    NonlinearModel model(Jacobian::exact);
    LooseSystem loose({&model});
    const std::vector<double> begin = loose.x;
    const auto solver = loose.solver(std::string(name));
    ASSERT_TRUE(loose.run(*solver, 0.004, 100));
    const std::vector<double> first = loose.x;
    const SolverStatistics counts = solver->statistics();
    loose.x = begin;
    solver->reset();
    ASSERT_TRUE(loose.run(*solver, 0.004, 100));
    EXPECT_EQ(loose.x, first) << name;
    EXPECT_EQ(solver->statistics().steps, counts.steps) << name;
    EXPECT_EQ(solver->statistics().evaluations, counts.evaluations) << name;
  }
}

TEST(Solvers, UnknownNamesAreReportedWithTheAllowedOnes) {
  NonlinearModel model;
  const LooseSystem loose({&model});
  try {
    static_cast<void>(loose.solver("euler"));
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    for (const std::string_view name : solver_names())
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace takt::test
