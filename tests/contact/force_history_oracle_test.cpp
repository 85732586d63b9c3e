// The largest force between points: against a half sine, a damped blow and kinks, whose largest values are known.
#include "server/contact/surface/force_history.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace takt {
namespace {

struct Found {
  double by_points = 0.0, with_vertices = 0.0, vertex_time_s = 0.0;
};

/// Points from `begin` on, with distances of `step` and `ratio` times `step` in turn.
Found sample(const std::function<double(double)>& force, double begin, double end, double step,
             double ratio) {
  ForceHistory history;
  Found found;
  bool longer = false;
  for (double t = begin; t <= end; t += longer ? ratio * step : step, longer = !longer) {
    const double f = std::max(0.0, force(t));
    history.add(t, f);
    found.by_points = std::max(found.by_points, f);
    found.with_vertices = std::max(found.with_vertices, f);
    const auto vertex = history.vertex();
    if (!vertex || vertex->force_N < found.with_vertices) continue;
    EXPECT_GE(vertex->force_N, found.by_points);
    EXPECT_LE(std::abs(vertex->time_s - history.middle_time_s()), 0.5 * std::max(1.0, ratio) * step + 1e-12);
    found.with_vertices = vertex->force_N, found.vertex_time_s = vertex->time_s;
  }
  return found;
}

// An undamped blow of a mass on a spring: a half sine. With eight points, wherever they lie.
TEST(ForceHistory, FindsTheTopOfAHalfSine) {
  double worst_by_points = 0.0;
  for (const double ratio : {0.7, 1.0, 1.4}) {
    const double step = std::numbers::pi / 8.0 * 2.0 / (1.0 + ratio);
    for (int k = 0; k < 40; ++k) {
      const double begin = -0.05 * k * step;
      const Found found = sample([](double t) { return std::sin(t); }, begin, 3.5, step, ratio);
      worst_by_points = std::max(worst_by_points, 1.0 - found.by_points);
      EXPECT_NEAR(found.with_vertices, 1.0, 0.005) << ratio << " " << begin;
      const double off = found.vertex_time_s - std::numbers::pi / 2.0;
      EXPECT_TRUE(found.vertex_time_s == 0.0 || std::abs(off) <= 0.1 * step) << off;
    }
  }
  EXPECT_GT(worst_by_points, 0.02);
}

// m x'' + d x' + k x = 0 from x' = 1: the force k x + d x' is exp(-zt)(...) and begins with a jump.
TEST(ForceHistory, FindsTheTopOfADampedBlow) {
  constexpr double kRatio = 0.2;
  const double w = std::sqrt(1.0 - kRatio * kRatio);
  const auto force = [&](double t) {
    if (t < 0.0) return 0.0;
    const double x = std::exp(-kRatio * t) * std::sin(w * t) / w;
    const double v = std::exp(-kRatio * t) * (std::cos(w * t) - kRatio / w * std::sin(w * t));
    return x + 2.0 * kRatio * v;
  };
  double top = 0.0;
  for (double t = 0.0; t < 4.0; t += 1e-4) top = std::max(top, force(t));
  for (int k = 0; k < 40; ++k) {
    const double step = std::numbers::pi / 8.0;
    const Found found = sample(force, -0.025 * k * step, 4.0, step, 1.0);
    EXPECT_LE(found.with_vertices, 1.005 * top) << k;
    EXPECT_GE(found.with_vertices, 0.995 * top) << k;
  }
}

// At a kink a parabola shows too much by up to an eighth of the rise of a step: what is shown never exceeds the top by more
// than a twelfth, where the kink lies amid two points, and not at all at a jump.
TEST(ForceHistory, ExaggeratesNoKink) {
  constexpr double kStep = 0.1;
  const std::function<double(double)> shapes[] = {
      [](double t) { return std::min(t, 1.0); },                            // a rise that ends
      [](double t) { return t < 1.0 ? t : std::max(0.0, 3.0 - 2.0 * t); },  // a hat
      [](double t) { return t < 1.0 ? 0.0 : std::max(0.0, 2.0 - t); },      // a jump, and a slow fall
      [](double t) { return t < 1.0 ? t : 0.0; },                           // a release
  };
  for (int shape = 0; shape < 4; ++shape)
    for (int k = 0; k < 50; ++k) {
      const double most = sample(shapes[shape], -0.02 * k * kStep, 3.0, kStep, 1.0).with_vertices;
      EXPECT_LE(most, 1.0 + (shape < 2 ? kStep / 12.0 : 0.0) + 1e-12) << shape << " " << k;
    }
}

TEST(ForceHistory, NeedsFourPointsInOrder) {
  ForceHistory history;
  history.add(0.0, 0.0), history.add(1.0, 3.0), history.add(2.0, 4.0);
  EXPECT_FALSE(history.vertex());
  history.add(3.0, 3.0);
  ASSERT_TRUE(history.vertex());
  EXPECT_DOUBLE_EQ(history.vertex()->time_s, 2.0);
  history.add(3.0, 9.0);  // the same time again
  EXPECT_DOUBLE_EQ(history.vertex()->force_N, 4.0);
  history.add(1.0, 1.0);  // back
  EXPECT_FALSE(history.vertex());
}

}  // namespace
}  // namespace takt
