// Trapezoids of speed: closed forms, continuity, limits.
#include "plant_models/mechanics/axis_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "plant_models/state_bytes.h"

namespace takt {
namespace {

const AxisLimits kLimits{-1.0, 1.0, 2.0};

TEST(AxisMotion, AMoveFromRestTakesTheTimeOfItsTrapezoid) {
  AxisMotion axis;
  axis.rest_at(0.0);
  axis.move_to(1.0, 0.5, 0.4, kLimits);  // 0.5 / 0.4 + 0.4 / 2
  EXPECT_FALSE(axis.at_rest(1.0));
  EXPECT_FALSE(axis.at_rest(2.449));
  EXPECT_TRUE(axis.at_rest(2.4500001));
  EXPECT_EQ(axis.position(2.46), 0.5);
  EXPECT_NEAR(axis.position(1.2), 0.04, 1e-15);
  EXPECT_NEAR(axis.speed(1.7), 0.4, 1e-15);
  EXPECT_NEAR(axis.next_corner(1.0), 1.2, 1e-15);
  // Too short to reach the speed: 2 sqrt(0.08 / 2).
  axis.move_to(5.0, 0.42, 0.4 + 1.0, kLimits);
  EXPECT_NEAR(axis.next_corner(5.3), 5.0 + 2.0 * std::sqrt(0.08 / 2.0), 1e-12);
}

TEST(AxisMotion, ATargetBehindIsReachedByBrakingAndReturning) {
  AxisMotion axis;
  axis.rest_at(0.0);
  axis.move_to(0.0, 1.0, 0.5, kLimits);
  axis.move_to(1.0, 0.4, 0.5, kLimits);  // at 0.4375 m with 0.5 m/s: stops at 0.5, then back by 0.1
  double furthest = 0.0;
  for (double t = 1.0; t < 2.0; t += 1e-3) furthest = std::max(furthest, axis.position(t));
  EXPECT_NEAR(furthest, 0.5, 1e-5);
  EXPECT_EQ(axis.position(3.0), 0.4);
}

TEST(AxisMotion, ASpeedEndsAtTheLimitAndZeroBrakes) {
  AxisMotion axis;
  axis.rest_at(0.0);
  axis.run_at(0.0, -0.4, kLimits);
  EXPECT_NEAR(axis.speed(1.0), -0.4, 1e-15);
  EXPECT_EQ(axis.position(10.0), -1.0);
  axis.run_at(20.0, 0.4, kLimits);
  axis.run_at(21.0, 0.0, kLimits);  // brakes over 0.04 m
  EXPECT_NEAR(axis.position(25.0), -1.0 + 0.04 + 0.4 * 0.8 + 0.04, 1e-12);
  EXPECT_TRUE(axis.at_rest(25.0));
  AxisMotion endless;
  endless.rest_at(3.0);
  endless.run_at(0.0, 0.5, {.acceleration = 1.0});
  EXPECT_NEAR(endless.position(100.0), 3.0 + 0.125 + 0.5 * 99.5, 1e-12);
  EXPECT_FALSE(endless.at_rest(100.0));
}

TEST(AxisMotion, RandomCommandsKeepLimitsAndContinuity) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-1.2, 1.2), fraction(0.05, 1.0);
  AxisMotion axis;
  axis.rest_at(0.0);
  const double h = 1e-3;
  double t = 0.0, q = 0.0, v = 0.0;
  for (int command = 0; command < 400; ++command) {
    if (command % 3 == 0)
      axis.run_at(t, anywhere(random), kLimits);
    else
      axis.move_to(t, anywhere(random), fraction(random), kLimits);
    for (int i = static_cast<int>(1000.0 * fraction(random)); i > 0; --i) {
      t += h;
      const double next = axis.position(t), speed = axis.speed(t);
      ASSERT_LE(std::abs(next), 1.0 + 1e-9);
      ASSERT_LE(std::abs(speed), 1.2 + 1e-9);
      ASSERT_LE(std::abs(speed - v), 2.0 * h + 1e-9) << t;
      // A change of acceleration within h alters the mean of the speeds by less than a h / 2.
      ASSERT_NEAR(next - q, 0.5 * h * (speed + v), 2.0 * h * h) << t;
      q = next, v = speed;
    }
  }
  std::vector<std::byte> bytes;
  StateWriter out(bytes);
  axis.save(out);
  AxisMotion loaded;
  StateReader in(bytes);
  loaded.load(in);
  for (double s = t; s < t + 3.0; s += 0.01) ASSERT_EQ(loaded.position(s), axis.position(s));
}

}  // namespace
}  // namespace takt
