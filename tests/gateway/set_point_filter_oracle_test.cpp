// The filter between controllers of wall time and the steps of a cell, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client_lib/gateway/set_point_filter.h"

namespace {

using takt::gateway::SetPointFilter;
using takt::gateway::SetPointFilterOptions;

SetPointFilterOptions options_of(double period_s) {
  SetPointFilterOptions options;
  options.bandwidth_rad_per_s = 60.0;
  options.period_s = period_s;
  options.lower = {-3.0};
  options.upper = {3.0};
  options.fastest = {2.0};
  return options;
}

TEST(SetPointFilter, AConstantVelocityIsFollowedWithoutLagFromAnyAge) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> age(0.0, 0.008);
  SetPointFilter filter(options_of(0.008));
  double q = 0.0, v = 0.0;
  for (int n = 0; n < 200; ++n) {
    const double t = 0.008 * n, sent = t - age(random);
    filter.take({0.7 * sent}, {0.7}, sent);
    const auto next = filter.next(t, t);
    ASSERT_TRUE(next);
    q = next->positions[0];
    v = next->velocities[0];
    EXPECT_NEAR(q, 0.7 * t, 1e-12) << n;
    EXPECT_NEAR(v, 0.7, 1e-9) << n;
  }
}

TEST(SetPointFilter, AStepOfTheReferenceIsTheClosedFormOfTwoEqualPoles) {
  // From rest, a step at n = 1. Of a double pole p the error is e[n] = (1 + b n) p^n; e[1] = 1 - alpha = p^2 gives b = p - 1.
  SetPointFilter filter(options_of(0.008));
  filter.take({0.0}, {}, 0.0);
  ASSERT_TRUE(filter.next(0.0, 0.0));
  const double p = std::exp(-60.0 * 0.008), b = p - 1.0;
  for (int n = 1; n < 40; ++n) {
    filter.take({0.01}, {}, 0.008 * n);
    const auto next = filter.next(0.008 * n, 0.008 * n);
    ASSERT_TRUE(next);
    EXPECT_NEAR(0.01 - next->positions[0], 0.01 * (1.0 + b * n) * std::pow(p, n), 2e-7) << n;
  }
}

TEST(SetPointFilter, ASlowCellSeesVelocitiesOfItsOwnTime) {
  // The cell runs at half of wall time: the motion of 0.3 rad/s is one of 0.6 rad/s there.
  SetPointFilter filter(options_of(0.008));
  std::optional<SetPointFilter::SetPoint> last;
  for (int n = 0; n < 200; ++n) {
    const double wall = 0.016 * n;
    filter.take({0.3 * wall}, {0.3}, wall);
    last = filter.next(0.008 * n, wall);
    ASSERT_TRUE(last);
  }
  EXPECT_NEAR(last->velocities[0], 0.6, 1e-9);
  EXPECT_NEAR(last->positions[0], 0.3 * 0.016 * 199, 1e-9);
}

TEST(SetPointFilter, JitterOfTheAgeIsDamped) {
  // Velocities of neighbouring set-points that differ by 0.2 rad/s without the filter.
  SetPointFilter filter(options_of(0.008));
  double before = 0.5, largest = 0.0;
  for (int n = 0; n < 400; ++n) {
    const double t = 0.008 * n, late = n % 2 == 0 ? 0.0 : 0.0016;
    filter.take({0.5 * (t - late)}, {0.0}, t);
    const auto next = filter.next(t, t);
    ASSERT_TRUE(next);
    if (n > 100) largest = std::max(largest, std::abs(next->velocities[0] - before));
    before = next->velocities[0];
  }
  EXPECT_LT(largest, 0.03);
  EXPECT_GT(largest, 0.0);
}

TEST(SetPointFilter, ARestIsReachedExactlyAndThenNothingIsSent) {
  SetPointFilter filter(options_of(0.008));
  filter.take({0.1}, {0.5}, 0.0);
  ASSERT_TRUE(filter.next(0.0, 0.0));
  filter.take({0.12}, {0.0}, 0.001);
  double last = 0.0;
  int sent = 0;
  for (int n = 1; n < 200; ++n)
    if (const auto next = filter.next(0.008 * n, 0.008 * n)) {
      last = next->positions[0];
      sent = n;
    }
  EXPECT_EQ(last, 0.12);
  EXPECT_LT(sent, 80);
  // A controller that repeats its position keeps its stream alive.
  filter.take({0.12}, {0.0}, 1.7);
  const auto repeated = filter.next(1.7, 1.7);
  ASSERT_TRUE(repeated);
  EXPECT_EQ(repeated->positions[0], 0.12);
}

TEST(SetPointFilter, TheLastSetPointOfASilentControllerIsReachedThoughItHadAVelocity) {
  SetPointFilter filter(options_of(0.008));
  double last = 0.0;
  for (int n = 0; n < 200; ++n) {
    const double t = 0.008 * n;
    if (n <= 50) filter.take({0.5 * t}, {0.5}, t);
    if (const auto next = filter.next(t, t + 0.002)) last = next->positions[0];
  }
  EXPECT_EQ(last, 0.5 * 0.008 * 50);
}

TEST(SetPointFilter, LimitsOfJointsAreNeverLeft) {
  SetPointFilter filter(options_of(0.008));
  for (int n = 0; n < 400; ++n) {
    const double t = 0.008 * n, wanted = std::min(3.0, 2.0 * t);
    filter.take({wanted}, {wanted < 3.0 ? 2.0 : 0.0}, t);
    const auto next = filter.next(t, t + 0.004);
    if (!next) continue;
    EXPECT_LE(next->positions[0], 3.0);
    EXPECT_LE(std::abs(next->velocities[0]), 2.0);
  }
}

TEST(SetPointFilter, WithinAPeriodNothingIsSentAndAClearedFilterBeginsAgain) {
  SetPointFilter filter(options_of(0.004));
  EXPECT_FALSE(filter.next(0.0, 0.0));
  filter.take({1.0}, {}, 0.0);
  EXPECT_TRUE(filter.next(0.0, 0.0));
  filter.take({1.0}, {}, 0.001);
  EXPECT_FALSE(filter.next(0.001, 0.001));
  EXPECT_TRUE(filter.next(0.004, 0.004));
  filter.clear();
  EXPECT_FALSE(filter.next(0.008, 0.008));
  filter.take({-1.0}, {}, 0.009);
  const auto first = filter.next(0.012, 0.012);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->positions[0], -1.0);
}

}  // namespace
