#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "client_lib/kinematics/motion_profile.h"

namespace takt::controller {
namespace {

constexpr double kSample_s = 0.008;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_smooth_within(const MotionProfile& profile, const ProfileLimits& limits) {
  const double h = profile.duration_s() / 20000.0;
  // The largest jerk: acceleration rises as 6 u (1 - u) v / ramp over a ramp of 1.5 v / a.
  const double speed = std::min(limits.speed, std::sqrt(limits.acceleration / 1.5));
  const double jerk = 6.0 * speed / std::pow(1.5 * speed / limits.acceleration, 2.0);
  double top_speed = 0.0, top_acceleration = 0.0;
  for (int i = 1; i < 20000; ++i) {
    const MotionProfile::Sample before = profile.at_time((i - 1) * h), here = profile.at_time(i * h);
    const MotionProfile::Sample after = profile.at_time((i + 1) * h);
    ASSERT_GE(here.s, before.s);
    ASSERT_NEAR((after.s - before.s) / (2.0 * h), here.speed, h * h * jerk + 1e-10) << i;
    ASSERT_NEAR((after.speed - before.speed) / (2.0 * h), here.acceleration, h * jerk + 1e-10) << i;
    ASSERT_LE(std::abs(here.acceleration - before.acceleration), h * jerk + 1e-10) << i;
    top_speed = std::max(top_speed, here.speed);
    top_acceleration = std::max(top_acceleration, std::abs(here.acceleration));
  }
  EXPECT_LE(top_speed, limits.speed * (1.0 + 1e-12));
  EXPECT_LE(top_acceleration, limits.acceleration * (1.0 + 1e-12));
}

TEST(MotionProfile, TheProfileKeepsLimitsAndIsTwiceDifferentiable) {
  for (const ProfileLimits limits : {ProfileLimits{0.5, 1.0}, {2.0, 0.3}, {0.1, 5.0}, {1.0, 1.5}}) {
    expect_smooth_within(MotionProfile::fastest(limits, kSample_s), limits);
  }
}

TEST(MotionProfile, TheProfileIsTheFastestOfItsKind) {
  // With cruise: 1 / v + 1.5 v / a. Without: twice the ramp of the peak speed sqrt(a / 1.5).
  EXPECT_NEAR(MotionProfile::fastest({0.5, 1.0}, 1e-6).duration_s(), 2.0 + 0.75, 2e-6);
  EXPECT_NEAR(MotionProfile::fastest({kInfinity, 0.3}, 1e-6).duration_s(), 2.0 / std::sqrt(0.2), 2e-6);
  EXPECT_NEAR(MotionProfile::fastest({0.25, kInfinity}, 1e-6).duration_s(), 4.0, 2e-6);
}

TEST(MotionProfile, TheProfileEndsExactlyAfterWholePeriods) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(0.05, 5.0);
  for (int i = 0; i < 1000; ++i) {
    const MotionProfile profile = MotionProfile::fastest({value(random), value(random)}, kSample_s);
    EXPECT_EQ(profile.duration_s(), static_cast<double>(profile.periods()) * kSample_s);
    const MotionProfile::Sample end = profile.at_period(profile.periods());
    EXPECT_EQ(end.s, 1.0);
    EXPECT_EQ(end.speed, 0.0);
    EXPECT_EQ(end.acceleration, 0.0);
    EXPECT_LT(profile.at_period(profile.periods() - 1).s, 1.0);
    EXPECT_NEAR(
        profile.at_period(profile.periods() / 2).s +
            profile.at_time(profile.duration_s() - static_cast<double>(profile.periods() / 2) * kSample_s).s,
        1.0, 1e-12);
  }
}

TEST(MotionProfile, AMotionOfNoLengthTakesOnePeriod) {
  EXPECT_EQ(MotionProfile::fastest({kInfinity, kInfinity}, kSample_s).periods(), 1);
}

TEST(MotionProfile, TheProfileLastsTheGivenDuration) {
  const ProfileLimits limits{0.5, 1.0};  // 2.75 s at least
  EXPECT_FALSE(MotionProfile::lasting(2.7, limits, kSample_s).has_value());
  const auto profile = MotionProfile::lasting(4.0, limits, kSample_s);
  ASSERT_TRUE(profile.has_value());
  EXPECT_EQ(profile->periods(), 500);
  expect_smooth_within(*profile, limits);
}

}  // namespace
}  // namespace takt::controller
