// The solver of bounded cost (implicit) in surface contact at communication steps of 1 ms: impacts, sliding,
// order in smooth motion, and its work, counted.
#include <gtest/gtest.h>

#include <cmath>

#include "server/simulation/solver/implicit_integrator.h"
#include "tests/support/ode_models.h"
#include "tests/support/solver_figures.h"

namespace takt::test {
namespace {

constexpr auto kMaxAttempts = static_cast<std::uint64_t>(ImplicitIntegrator::kMaxAttempts);
const SolverSetting kBounded{"implicit"};
const SolverSetting kExact{"cvode", 1e-9};

void expect_bounded(const LargestWork& work) {
  EXPECT_LE(work.attempts, kMaxAttempts);
  EXPECT_LE(work.evaluations, 4 * kMaxAttempts);
}

TEST(BoundedSolver, RestitutionEqualsThatOfTheModelAtAnyDamping) {
  for (const double damping : {0.0, 1e3, 1e4, 1e5, 2.5e5, 1e6}) {
    SCOPED_TRACE(damping);
    const SolverFigure found = restitution(kBounded, damping);
    EXPECT_NEAR(found.value, restitution(kExact, damping).value, 0.02);
    EXPECT_LT(found.value, 1.0) << "no energy comes from nowhere";
    if (damping == 0.0) {
      EXPECT_GT(found.value, 0.95);
    }
    expect_bounded(found.work);
  }
}

TEST(BoundedSolver, ASlabStopsWhereFrictionHasTakenItsEnergy) {
  const SolverFigure found = stopping_distance(kBounded);
  EXPECT_NEAR(found.value, 1.0 / (2.0 * 0.3 * 9.80665), 0.005 * found.value);
  expect_bounded(found.work);
}

TEST(BoundedSolver, ABlockSlidesOneDegreeAboveTheFrictionAngle) {
  for (const char* law : {"regularised", "stick"}) {
    const SolverFigure found = way_above_friction_angle(kBounded, law);
    const double exact = way_above_friction_angle(kExact, law).value;
    EXPECT_NEAR(found.value, exact, 0.015 * exact) << law;
    expect_bounded(found.work);
  }
}

// Smooth motion is taken in whole communication steps, by ROS2.
TEST(BoundedSolver, TheOrderIsTwoInSmoothMotionWithStiffPairs) {
  using Jacobian = NonlinearModel::Jacobian;
  for (const Jacobian jacobian : {Jacobian::none, Jacobian::wrong, Jacobian::exact}) {
    const auto error = [jacobian](double h) {
      NonlinearModel model(jacobian);
      LooseSystem loose({&model});
      loose.system().set_stiff_pairs(true);
      const auto solver = loose.solver("implicit");
      const int steps = static_cast<int>(std::lround(2.0 / h));
      EXPECT_TRUE(loose.run(*solver, h, steps)) << solver->failure();
      EXPECT_EQ(solver->statistics().steps, static_cast<std::uint64_t>(steps));
      return NonlinearModel::error(2.0, loose.x);
    };
    EXPECT_NEAR(std::log2(error(0.01) / error(0.005)), 2.0, 0.15) << static_cast<int>(jacobian);
  }
}

/// A force that a step of any size misjudges: it has the sign of rounding.
class RestlessForce final : public FreeModel {
 public:
  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = 0.0; }
  void derivatives(double t, const double*, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = 1e5 * std::sin(1e9 * t);
  }
};

TEST(BoundedSolver, AttemptsAreCountedAndTheStepEndsAtTheBound) {
  RestlessForce model;
  LooseSystem loose({&model});
  loose.system().set_stiff_pairs(true);
  const auto solver = loose.solver("implicit");
  SolverStatistics before;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(loose.run(*solver, 1e-3, 1, i)) << solver->failure();
    const SolverStatistics& after = solver->statistics();
    EXPECT_LE(after.steps + after.rejected_steps - before.steps - before.rejected_steps, kMaxAttempts);
    EXPECT_LE(after.evaluations - before.evaluations, 4 * kMaxAttempts);
    EXPECT_GT(after.forced_steps, before.forced_steps);
    before = after;
  }
  EXPECT_TRUE(std::isfinite(loose.x[0]));
}

}  // namespace
}  // namespace takt::test
