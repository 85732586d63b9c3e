// A derivative that is not a number, at any call: the solvers with error control recover from one, and end
// with a reason when it stays; never a state that is not finite.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/ode_models.h"

namespace takt::test {
namespace {

const std::vector<std::string> kAdaptive{"cvode", "esdirk", "esdirk4", "ida"};
constexpr double kSolverTolerance = 1e-6, kSolverStep = 0.02;
constexpr int kSolverSteps = 5;

TEST(SolverFailures, OneBadValueAtAnyCallIsRecovered) {
  for (const std::string& name : kAdaptive) {
    FaultyModel good;
    LooseSystem reference({&good});
    const auto solver = reference.solver(name, kSolverTolerance);
    ASSERT_TRUE(reference.run(*solver, kSolverStep, kSolverSteps));
    const long calls = good.calls;
    ASSERT_GT(calls, 50) << name;
    for (long k = 1; k <= calls; ++k) {
      FaultyModel model;
      model.first_bad = model.last_bad = k;
      LooseSystem loose({&model});
      const auto s = loose.solver(name, kSolverTolerance);
      ASSERT_TRUE(loose.run(*s, kSolverStep, kSolverSteps)) << name << " call " << k << ": " << s->failure();
      EXPECT_NEAR(loose.x[0], FaultyModel::position(kSolverStep * kSolverSteps), 3e-4)
          << name << " call " << k;
    }
  }
}

TEST(SolverFailures, ManyBadValuesInARowAreRecoveredOrEndWithAReason) {
  for (const std::string& name : kAdaptive) {
    int recovered = 0;
    for (long k = 1; k <= 200; k += 3) {
      for (const long length : {3L, 10L, 100L}) {
        FaultyModel model;
        model.first_bad = k, model.last_bad = k + length;
        LooseSystem loose({&model});
        const auto s = loose.solver(name, kSolverTolerance);
        if (loose.run(*s, kSolverStep, kSolverSteps)) {
          ++recovered;
          EXPECT_NEAR(loose.x[0], FaultyModel::position(kSolverStep * kSolverSteps), 1e-3)
              << name << " call " << k;
        } else {
          EXPECT_NE(s->failure(), "") << name << " call " << k;
        }
        for (const double value : loose.x) EXPECT_TRUE(std::isfinite(value)) << name << " call " << k;
      }
    }
    EXPECT_GT(recovered, 60) << name;
  }
}

TEST(SolverFailures, PersistentBadValuesEndWithAReason) {
  for (const std::string& name : kAdaptive) {
    for (long k = 1; k <= 60; ++k) {
      FaultyModel model;
      model.first_bad = k, model.last_bad = std::numeric_limits<long>::max();
      LooseSystem loose({&model});
      const auto s = loose.solver(name, kSolverTolerance);
      ASSERT_FALSE(loose.run(*s, kSolverStep, kSolverSteps)) << name << " call " << k;
      EXPECT_NE(s->failure().find("no step succeeded"), std::string::npos) << s->failure();
      EXPECT_LT(model.calls, 5000) << name;
      // And after a reset it works again.
      model.last_bad = -1;
      loose.system().initial_state(loose.x);
      s->reset();
      EXPECT_EQ(s->failure(), "");
      ASSERT_TRUE(loose.run(*s, kSolverStep, kSolverSteps)) << name;
      EXPECT_NEAR(loose.x[0], FaultyModel::position(kSolverStep * kSolverSteps), 3e-4) << name;
    }
  }
}

/// A Jacobian that linearly implicit steps cannot use.
class BadJacobianModel final : public FreeModel {
 public:
  explicit BadJacobianModel(double value) : value_(value) {}
  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = 1.0; }
  void derivatives(double, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = -x[0];
  }
  void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const override { entries = {{0, 0}}; }
  void jacobian(double, const double*, const CellMotion&, double* values) const override {
    values[0] = value_;
  }

 private:
  double value_;
};

TEST(SolverFailures, ImplicitStepsNameASingularMatrix) {
  const double h = 0.01, gamma = 1.0 - std::sqrt(0.5);
  BadJacobianModel singular(1.0 / (gamma * h));  // the other root of the method still works
  LooseSystem one({&singular});
  const auto first = one.solver("implicit");
  EXPECT_TRUE(one.run(*first, h, 1));
  EXPECT_NEAR(one.x[0], std::exp(-h), 0.05);
  EXPECT_EQ(first->statistics().newton_failures, 1U);

  BadJacobianModel not_a_number(std::numeric_limits<double>::quiet_NaN());
  LooseSystem two({&not_a_number});
  const auto second = two.solver("implicit");
  EXPECT_FALSE(two.run(*second, h, 1));
  EXPECT_NE(second->failure().find("no inverse"), std::string::npos) << second->failure();
  EXPECT_EQ(two.x[0], 1.0);
}

}  // namespace
}  // namespace takt::test
