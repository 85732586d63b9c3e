// Modes of plant models: located by the solvers with error control, switched at the end of a step by the
// others; known corners; modes that never settle.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/ode_models.h"

namespace takt::test {
namespace {

TEST(SolverEvents, BouncesAreLocated) {
  for (const std::string& name : kAdaptive) {
    BouncingModel ball;
    LooseSystem loose({&ball});
    const auto solver = loose.solver(name, 1e-9);
    ASSERT_TRUE(loose.run(*solver, 0.01, 150)) << name << ": " << solver->failure();
    ASSERT_EQ(ball.bounces.size(), 3U) << name;  // up to 1.5 s
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(ball.bounces[static_cast<std::size_t>(k)], BouncingModel::bounce_time(k), 1e-7) << name;
    EXPECT_GE(solver->statistics().mode_switches, 6U) << name;
    EXPECT_GE(solver->statistics().restarts, 6U) << name;
  }
}

TEST(SolverEvents, FixedStepsSwitchAtTheNextAcceptedPoint) {
  for (const std::string name : {"rk2", "rk4", "implicit"}) {
    BouncingModel ball;
    LooseSystem loose({&ball});
    const auto solver = loose.solver(name);
    ASSERT_TRUE(loose.run(*solver, 0.001, 500));
    ASSERT_EQ(ball.bounces.size(), 1U) << name;
    EXPECT_GE(ball.bounces[0], BouncingModel::bounce_time(0) - 1e-9) << name;
    EXPECT_LE(ball.bounces[0], BouncingModel::bounce_time(0) + 1.001e-3) << name;
    EXPECT_GE(solver->statistics().mode_switches, 1U) << name;
  }
}

double stop_time() {
  // Where the closed form of the speed returns to zero.
  double low = 1.5, high = 2.4;
  EXPECT_GT(StickSlipModel::speed(low), 0.0);
  EXPECT_LT(StickSlipModel::speed(high), 0.0);
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (StickSlipModel::speed(middle) > 0.0 ? low : high) = middle;
  }
  return low;
}

TEST(SolverEvents, DryFrictionBreaksAwayAndSticksInTime) {
  for (const std::string& name : kAdaptive) {
    StickSlipModel mass;
    LooseSystem loose({&mass});
    const auto solver = loose.solver(name, 1e-9);
    ASSERT_TRUE(loose.run(*solver, 0.008, 120)) << name << ": " << solver->failure();
    EXPECT_NEAR(loose.x[1], StickSlipModel::speed(0.96), 1e-7) << name;
    ASSERT_TRUE(loose.run(*solver, 0.008, 155, 120)) << name << ": " << solver->failure();
    ASSERT_GE(mass.switches.size(), 2U) << name;
    EXPECT_NEAR(mass.switches[0], StickSlipModel::break_away_time(), 1e-9) << name;
    EXPECT_NEAR(mass.switches[1], stop_time(), 1e-6) << name;
  }
}

TEST(SolverEvents, KnownCornersAreMetExactly) {
  for (const double corner : {0.01234, 0.02, 0.0200000000000001, 0.03 - 1e-13}) {
    for (const std::string& name : kErrorControlled) {
      CornerModel model(corner);
      LooseSystem loose({&model});
      const auto solver = loose.solver(name, 1e-2);
      ASSERT_TRUE(loose.run(*solver, 0.01, 5)) << name << ": " << solver->failure();
      EXPECT_NEAR(loose.x[0], corner - 2.0 * (0.05 - corner), 1e-12) << name << " " << corner;
      EXPECT_EQ(solver->statistics().restarts, 2U) << name << " " << corner;
    }
  }
}

TEST(SolverEvents, ModesThatNeverSettleEndInAFailure) {
  for (const std::string& name : kAdaptive) {
    RestlessModel model;
    LooseSystem loose({&model});
    const auto solver = loose.solver(name);
    EXPECT_FALSE(loose.run(*solver, 0.01, 5)) << name;
    EXPECT_NE(solver->failure().find("switch without end at t = 0.00"), std::string::npos)
        << solver->failure();
  }
}

TEST(SolverEvents, ARestartFromOutsideCountsAndChangesLittle) {
  for (const std::string& name : kErrorControlled) {
    NonlinearModel model;
    LooseSystem with({&model}), without({&model});
    const auto a = with.solver(name, 1e-8), b = without.solver(name, 1e-8);
    ASSERT_TRUE(with.run(*a, 0.1, 10));
    a->restart();
    ASSERT_TRUE(with.run(*a, 0.1, 10, 10));
    ASSERT_TRUE(without.run(*b, 0.1, 20));
    EXPECT_EQ(a->statistics().restarts, 2U) << name;
    EXPECT_EQ(b->statistics().restarts, 1U) << name;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(with.x[i], without.x[i], 1e-6) << name;
  }
}

}  // namespace
}  // namespace takt::test
