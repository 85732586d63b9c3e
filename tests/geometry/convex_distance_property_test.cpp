// Distance and penetration depth against brute force over all axes and features.
#include "server/geometry/convex/distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <vector>

#include "server/geometry/convex/overlap.h"
#include "tests/support/convex_oracle.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::Random;

constexpr double kExact = 1e-6;  // m

double highest(const std::vector<Vec3>& points, const Vec3& d) {
  double h = d.dot(points.front());
  for (const Vec3& p : points) h = std::max(h, d.dot(p));
  return h;
}

/// Normal and points must agree with the distance.
void expect_consistent(const ConvexDistance& d, const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  EXPECT_NEAR(d.normal_W.norm(), 1.0, 1e-12);
  // The gap of the shapes' extents along the normal is the distance...
  EXPECT_NEAR(-highest(b, -d.normal_W) - highest(a, d.normal_W), d.distance, kExact);
  // ... the points are extreme on it, and apart by the distance along it.
  EXPECT_NEAR(d.normal_W.dot(d.point_A_W), highest(a, d.normal_W), kExact);
  EXPECT_NEAR(-d.normal_W.dot(d.point_B_W), highest(b, -d.normal_W), kExact);
  EXPECT_LT((d.point_B_W - d.point_A_W - d.distance * d.normal_W).norm(),
            std::max(kExact, 1e-4 * std::abs(d.distance)));
}

struct Tally {
  int pairs = 0, apart = 0, wrong = 0;
  double largest_error = 0.0, largest_bracket = 0.0;
};

void compare(Random& random, const Vec3& stretch_a, const Vec3& stretch_b, Tally& tally) {
  const auto pa = random.points(stretch_a, random.integer(0, 1) == 1);
  const auto pb = random.points(stretch_b, random.integer(0, 1) == 1);
  const ConvexShape a = ConvexShape::from_points(pa);
  const ConvexShape b = ConvexShape::from_points(pb);
  const Pose X_WA{random.rotation(), random.direction()};
  Pose X_WB{random.integer(0, 3) == 0 ? X_WA.R : random.rotation(), Vec3::Zero()};
  X_WB.p = X_WA * a.center_B - X_WB.R * b.center_B +
           random.direction() * random.uniform(0.0, 1.0) * (a.radius + b.radius);
  if (random.integer(0, 2) == 0) {
    const test::Gap gap = test::separating_gap(test::to_world(pa, X_WA), test::to_world(pb, X_WB));
    X_WB.p +=
        gap.axis * (random.log_uniform(1e-9, 1e-3) * (random.integer(0, 1) == 1 ? 1.0 : -1.0) - gap.value);
  }
  const auto wa = test::to_world(pa, X_WA);
  const auto wb = test::to_world(pb, X_WB);
  const double gap = test::separating_gap(wa, wb).value;
  const double expected = gap > 0.0 ? test::brute_force_distance(wa, wb) : gap;
  const ConvexDistance result = convex_distance(a, X_WA, b, X_WB);
  ++tally.pairs;
  tally.apart += expected > 0.0 ? 1 : 0;
  const double error = std::abs(result.distance - expected);
  tally.largest_error = std::max(tally.largest_error, error);
  tally.largest_bracket = std::max(tally.largest_bracket, result.error);
  if (!(error < kExact)) {
    if (++tally.wrong <= 5)
      ADD_FAILURE() << "pair " << tally.pairs << ": " << result.distance << " +- " << result.error
                    << ", exact " << expected << ", radii " << a.radius << " " << b.radius;
    return;
  }
  if (std::abs(expected) > kExact) expect_consistent(result, wa, wb);
}

void report(const char* name, const Tally& tally) {
  std::cout << name << ": " << tally.pairs << " pairs, " << tally.apart << " apart, largest error "
            << tally.largest_error << " m, widest bracket " << tally.largest_bracket << " m\n";
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.apart, tally.pairs / 10);
  EXPECT_LT(tally.apart, tally.pairs * 9 / 10);
}

TEST(ConvexDistance, RandomShapesHaveTheDistanceOfBruteForce) {
  Random random(31);
  Tally tally;
  for (int i = 0; i < 20000; ++i) {
    const auto stretch = [&] {
      return Vec3(random.uniform(0.1, 1), random.uniform(0.1, 1), random.uniform(0.1, 1));
    };
    const Vec3 sa = stretch(), sb = stretch();
    compare(random, sa, sb, tally);
  }
  report("distance", tally);
}

TEST(ConvexDistance, FlatAndNeedleShapesHaveTheDistanceOfBruteForce) {
  Random random(32);
  Tally tally;
  for (int i = 0; i < 5000; ++i) {
    const auto stretch = [&] {
      return Vec3(random.log_uniform(1e-4, 1), random.log_uniform(1e-4, 1), random.uniform(0.1, 1));
    };
    const Vec3 sa = stretch(), sb = stretch();
    compare(random, sa, sb, tally);
  }
  report("degenerate", tally);
}

TEST(ConvexDistance, ShapesOfManyVerticesHaveTheDistanceOfBruteForce) {
  // No axis may separate better than by the depth, and the result's axis separates as well.
  Random random(33);
  for (int i = 0; i < 200; ++i) {
    std::vector<Vec3> points;
    for (int k = 0; k < 300; ++k) points.push_back(Vec3(0.1, 0.06, 0.03).cwiseProduct(random.direction()));
    const ConvexShape shape = ConvexShape::from_points(points);
    const Pose X_WA{random.rotation(), random.direction()};
    const Pose X_WB{random.rotation(), X_WA.p + random.uniform(0.0, 0.2) * random.direction()};
    const auto wa = test::to_world(points, X_WA);
    const auto wb = test::to_world(points, X_WB);
    const ConvexDistance result = convex_distance(shape, X_WA, shape, X_WB);
    EXPECT_LT(result.error, 1e-8);
    expect_consistent(result, wa, wb);
    for (int k = 0; k < 2000; ++k) {
      const Vec3 n =
          k % 2 == 0 ? random.direction() : (result.normal_W + 0.1 * random.direction()).normalized();
      EXPECT_LE(-highest(wb, -n) - highest(wa, n), result.distance + 1e-8);
    }
  }
}

TEST(ConvexDistance, BoxesSideBySideHaveTheClosedFormDistance) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
  const ConvexShape box = ConvexShape::from_points(corners);
  for (const double x : {0.0, 0.5, 1.9, 2.0, 2.1, 5.0}) {
    const ConvexDistance d = convex_distance(box, Pose{}, box, {Mat3::Identity(), Vec3(x, 0.1, -0.2)});
    // At x = 0 the shortest way out is along z, then along x.
    EXPECT_NEAR(d.distance, x > 0.2 ? x - 2.0 : -1.8, 1e-9) << x;
    if (x > 0.2 && x != 2.0) {
      EXPECT_NEAR(d.normal_W.x(), 1.0, 1e-6) << x;
    }
  }
}

TEST(ConvexDistance, ShapesWithoutVolumeHaveADistance) {
  const ConvexShape point = ConvexShape::from_points({Vec3(0.1, 0.2, 0.3)});
  const ConvexShape square = ConvexShape::from_points({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
  const ConvexShape segment = ConvexShape::from_points({{-1, 0, 0}, {1, 0, 0}});
  EXPECT_NEAR(convex_distance(point, Pose{}, square, Pose{}).distance, 0.3, 1e-9);
  EXPECT_NEAR(convex_distance(point, Pose{}, point, Pose{}).distance, 0.0, 1e-12);
  EXPECT_NEAR(convex_distance(square, Pose{}, square, Pose{}).distance, 0.0, 1e-12);
  EXPECT_NEAR(convex_distance(segment, Pose{}, square, {Mat3::Identity(), Vec3(0, 0, -0.5)}).distance, 0.5,
              1e-9);
  EXPECT_NEAR(convex_distance(segment, Pose{}, square, {Mat3::Identity(), Vec3(0.3, 0, 0)}).distance, 0.0,
              1e-9);
}

}  // namespace
}  // namespace takt
