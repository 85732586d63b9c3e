// A body that falls on an elastic layer with friction: the demand of contact on implicit solvers.
#include <gtest/gtest.h>

#include <cmath>

#include "server/simulation/solver/implicit_integrator.h"
#include "server/simulation/solver/rosenbrock_integrator.h"
#include "tests/support/ode_models.h"

namespace takt::test {
namespace {

/// A block that falls and slides: height z, speed v, way y, speed w. The layer pushes as the contact law of
/// the thesis does, (2.18) to (2.21), over one square decimetre.
class ImpactModel final : public FreeModel {
 public:
  explicit ImpactModel(double mass_kg) : mass_(mass_kg) {}
  int state_count() const override { return 4; }
  void initial_state(double* x) const override { x[0] = 0.01, x[1] = -0.5, x[2] = 0.0, x[3] = 0.3; }
  void derivatives(double, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    const double force = normal_force(x);
    xdot[0] = x[1], xdot[1] = force / mass_ - kGravity;
    xdot[2] = x[3], xdot[3] = -kFriction * force * std::tanh(x[3] / kSpeed) / mass_;
  }
  void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const override {
    entries = {{0, 1}, {1, 0}, {1, 1}, {2, 3}, {3, 3}};
  }
  void jacobian(double, const double* x, const CellMotion&, double* values) const override {
    const double force = normal_force(x);
    const bool touching = force > 0.0;
    const double s = std::max(std::abs(x[3]) / kSpeed, 1e-9);
    values[0] = values[3] = 1.0;
    values[1] = touching ? -kStiffness / mass_ : 0.0;
    values[2] = touching ? -kDamping * std::min(1.0, -x[0] / kDampingDepth) / mass_ : 0.0;
    values[4] = -kFriction * force * std::tanh(s) / (s * kSpeed) / mass_;  // the secant
  }
  /// Outside the layer.
  double energy(const std::vector<double>& x) const {
    return mass_ * (0.5 * (x[1] * x[1] + x[3] * x[3]) + kGravity * x[0]);
  }
  double depth_at_rest() const { return mass_ * kGravity / kStiffness; }

 private:
  static constexpr double kGravity = 9.80665, kStiffness = 1.346e6, kDamping = 250.0, kDampingDepth = 2e-6,
                          kFriction = 0.3, kSpeed = 0.001;
  static double normal_force(const double* x) {
    const double depth = -x[0];
    if (depth <= 0.0) return 0.0;
    return std::max(0.0, kStiffness * depth - kDamping * std::min(1.0, depth / kDampingDepth) * x[1]);
  }
  double mass_;
};

struct Fall {
  std::vector<double> x;
  double highest_m = 0.0;        ///< after the first touch
  double gained_energy_J = 0.0;  ///< outside the layer, above that at the beginning
  SolverStatistics work;
};

Fall fall(double mass, const SolverParameters& parameters, double h, double end) {
  ImpactModel model(mass);
  LooseSystem loose({&model});
  loose.system().set_stiff_pairs(true);
  const auto solver = make_integrator(parameters, loose.system());
  const double before = model.energy(loose.x);
  Fall result;
  bool touched = false;
  for (int i = 0; i < static_cast<int>(std::lround(end / h)); ++i) {
    EXPECT_TRUE(loose.run(*solver, h, 1, i)) << solver->failure();
    touched = touched || loose.x[0] < 0.0 || loose.x[1] > 0.0;
    if (touched) result.highest_m = std::max(result.highest_m, loose.x[0]);
    if (loose.x[0] >= 0.0)
      result.gained_energy_J = std::max(result.gained_energy_J, model.energy(loose.x) - before);
  }
  result.x = loose.x;
  result.work = solver->statistics();
  return result;
}

TEST(Impact, TheRosenbrockMethodEqualsSmallSteps) {
  for (const double mass : {0.3, 5.0}) {
    const Fall exact = fall(mass, {"rk4", 0.0, 0.0}, 1e-5, 0.5);
    for (const double h : {0.001, 0.01}) {
      const Fall found = fall(mass, {"rosenbrock", 1e-4, 0.0}, h, 0.5);
      EXPECT_NEAR(found.x[0], exact.x[0], 6e-4) << mass << " " << h;
      EXPECT_NEAR(found.x[2], exact.x[2], 1e-4) << mass << " " << h;
      EXPECT_LT(found.work.steps + found.work.rejected_steps, 2000U) << mass << " " << h;
      EXPECT_EQ(found.work.forced_steps, 0U);
      EXPECT_LT(found.gained_energy_J, 1e-4 * mass);
    }
  }
}

// Also if the pieces of a step are longer than the impact: then energy is lost, never gained.
TEST(Impact, TheImplicitMethodEqualsSmallStepsAtBoundedWork) {
  constexpr auto most = static_cast<std::uint64_t>(ImplicitIntegrator::kMaxAttempts);
  for (const double mass : {0.3, 1.0, 5.0}) {
    const ImpactModel model(mass);
    const Fall exact = fall(mass, {"rk4", 0.0, 0.0}, 1e-5, 0.1),
               late = fall(mass, {"rk4", 0.0, 0.0}, 1e-5, 1.0);
    for (const double h : {0.0005, 0.001, 0.002, 0.004}) {
      SCOPED_TRACE(std::to_string(mass) + " kg, step " + std::to_string(h));
      const Fall early = fall(mass, {"implicit", 0.0, 0.0}, h, 0.1);
      EXPECT_NEAR(early.highest_m, exact.highest_m, 0.05 * exact.highest_m);
      const Fall found = fall(mass, {"implicit", 0.0, 0.0}, h, 1.0);
      EXPECT_LT(found.gained_energy_J, 1e-4 * mass);
      EXPECT_NEAR(found.x[0], late.x[0], 5e-6) << "at rest: " << -model.depth_at_rest();
      EXPECT_NEAR(found.x[3], 0.0, 1e-6);
      const auto steps = static_cast<std::uint64_t>(std::lround(1.0 / h));
      EXPECT_LT(found.work.steps + found.work.rejected_steps, most * steps);
      EXPECT_LE(found.work.evaluations, 4 * (found.work.steps + found.work.rejected_steps));
    }
  }
}

}  // namespace
}  // namespace takt::test
