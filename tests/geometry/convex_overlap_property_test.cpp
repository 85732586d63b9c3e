// The MPR verdict against two independent judges: brute force (exact) and FCL's distance by GJK.
#include "server/geometry/convex/overlap.h"

#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/convex_oracle.h"
#include "tests/support/effort.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::Random;

constexpr double kBand = 1e-6;  // m: verdicts may differ this close to touching, for shapes up to metres

int number_of_pairs() {
  return 20'000 * static_cast<int>(test::effort());
}

/// FCL's distance, -1 when the shapes overlap. Not its GJKSolver_indep: that one is wrong by millimetres in
/// 0.5 % of these pairs, as brute force shows.
double fcl_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  const auto convex = [](const std::vector<Vec3>& points) {
    // Up to 32 vertices FCL scans all of them; it uses the faces for larger shapes only.
    return fcl::Convex<double>(
        std::make_shared<const std::vector<fcl::Vector3d>>(points.begin(), points.end()), 1,
        std::make_shared<const std::vector<int>>(std::vector<int>{3, 0, 1, 2}));
  };
  fcl::detail::GJKSolver_libccd<double> solver;
  solver.distance_tolerance = 1e-9;
  solver.max_distance_iterations = 1000;
  double distance = -1.0;
  const bool apart = solver.shapeDistance(convex(a), fcl::Transform3d::Identity(), convex(b),
                                          fcl::Transform3d::Identity(), &distance, nullptr, nullptr);
  return apart ? distance : -1.0;
}

struct Counts {
  int pairs = 0;
  int overlapping = 0;
  int in_band = 0;
  int wrong = 0;
};

/// Places b so that it is near a, in half of the cases within 1e-3 of touching, and compares the verdicts.
void compare_overlap(Random& random, const Vec3& stretch_a, const Vec3& stretch_b, double scale,
                     double margin_limit, Counts& counts) {
  const auto pa = random.points(scale * stretch_a, random.integer(0, 1) == 1);
  const auto pb = random.points(scale * stretch_b, random.integer(0, 1) == 1);
  const ConvexShape a = ConvexShape::from_points(pa);
  const ConvexShape b = ConvexShape::from_points(pb);
  const Pose X_WA{random.rotation(), scale * 2.0 * random.direction()};
  Pose X_WB{random.rotation(), Vec3::Zero()};
  const double reach = a.radius + b.radius;
  X_WB.p = X_WA * a.center_B - X_WB.R * b.center_B + random.direction() * random.uniform(0.0, 1.0) * reach;
  if (random.integer(0, 1) == 1) {
    const test::Gap gap = test::separating_gap(test::to_world(pa, X_WA), test::to_world(pb, X_WB));
    const double wanted = random.log_uniform(1e-8, 1e-3) * scale * (random.integer(0, 1) == 1 ? 1.0 : -1.0);
    X_WB.p += gap.axis * (wanted - gap.value);
  }
  const double margin = random.integer(0, 2) == 0 ? 0.0 : random.uniform(0.0, margin_limit * scale);
  const auto wa = test::to_world(pa, X_WA);
  const auto wb = test::to_world(pb, X_WB);
  const double gap = test::separating_gap(wa, wb).value;
  const double distance = gap > 0.0 ? test::brute_force_distance(wa, wb) : gap;
  const bool verdict = convex_overlap(a, X_WA, b, X_WB, margin);
  ++counts.pairs;
  counts.overlapping += verdict ? 1 : 0;
  if (std::abs(distance - margin) < kBand * std::max(scale, 1.0)) {
    ++counts.in_band;
    return;
  }
  // The order of the two does not matter either.
  const bool swapped = convex_overlap(b, X_WB, a, X_WA, margin);
  const double fcl = fcl_distance(wa, wb);
  const bool fcl_verdict = fcl < margin;
  if (verdict != (distance < margin) || swapped != verdict ||
      (verdict != fcl_verdict && std::abs(distance) > kBand)) {
    ++counts.wrong;
    if (counts.wrong <= 5)
      ADD_FAILURE() << "pair " << counts.pairs << ": verdict " << verdict << ", swapped " << swapped
                    << ", gap " << gap << ", distance " << distance << ", FCL " << fcl << ", margin "
                    << margin << ", radii " << a.radius << " " << b.radius;
  }
}

void report_counts(const char* name, const Counts& counts) {
  ::testing::Test::RecordProperty(std::string(name) + "_pairs", counts.pairs);
  std::cout << name << ": " << counts.pairs << " pairs, " << counts.overlapping << " overlapping, "
            << counts.in_band << " within the band, " << counts.wrong << " wrong\n";
  EXPECT_EQ(counts.wrong, 0);
  // Both verdicts must be well represented, else the test has no significance.
  EXPECT_GT(counts.overlapping, counts.pairs / 10);
  EXPECT_LT(counts.overlapping, counts.pairs * 9 / 10);
}

TEST(ConvexOverlap, RandomPairsHaveTheVerdictOfSeparatingAxesAndFcl) {
  Random random(1);
  Counts counts;
  for (int i = 0; i < number_of_pairs(); ++i) {
    const Vec3 sa(random.uniform(0.1, 1.0), random.uniform(0.1, 1.0), random.uniform(0.1, 1.0));
    const Vec3 sb(random.uniform(0.1, 1.0), random.uniform(0.1, 1.0), random.uniform(0.1, 1.0));
    compare_overlap(random, sa, sb, 1.0, 0.05, counts);
  }
  report_counts("random", counts);
}

TEST(ConvexOverlap, FlatAndNeedleShapesHaveTheVerdictOfSeparatingAxes) {
  Random random(2);
  Counts counts;
  for (int i = 0; i < number_of_pairs() / 10; ++i) {
    const auto stretch = [&] {
      return Vec3(random.log_uniform(1e-5, 1.0), random.log_uniform(1e-5, 1.0), random.log_uniform(0.1, 1.0));
    };
    const Vec3 sa = stretch();
    const Vec3 sb = stretch();
    compare_overlap(random, sa, sb, 1.0, 0.01, counts);
  }
  report_counts("degenerate", counts);
}

TEST(ConvexOverlap, ShapesOfVeryDifferentSizeHaveTheVerdictOfSeparatingAxes) {
  Random random(3);
  Counts counts;
  for (int i = 0; i < number_of_pairs() / 10; ++i) {
    const double ratio = random.log_uniform(1e-3, 1.0);
    compare_overlap(random, Vec3::Ones(), Vec3::Constant(ratio), 1.0, 0.01, counts);
  }
  report_counts("size_ratio", counts);
}

TEST(ConvexOverlap, HugeShapesHaveTheVerdictOfSeparatingAxes) {
  Random random(4);
  Counts counts;
  for (int i = 0; i < number_of_pairs() / 100; ++i)
    compare_overlap(random, Vec3::Ones(), Vec3::Ones(), 1000.0, 0.01, counts);
  report_counts("huge", counts);
}

TEST(ConvexOverlap, TinyShapesAreJudgedRelativeToTheirSize) {
  // 10 um boxes: libccd's absolute tolerances would call them overlapping at distances of their own size.
  Random random(5);
  const double h = 5e-6;
  const ConvexShape box = ConvexShape::from_points(
      {{-h, -h, -h}, {h, -h, -h}, {-h, h, -h}, {h, h, -h}, {-h, -h, h}, {h, -h, h}, {-h, h, h}, {h, h, h}});
  for (int i = 0; i < 1000; ++i) {
    const Pose X_WA{random.rotation(), random.direction()};
    const double lateral = random.uniform(-0.9, 0.9) * h;
    for (const double gap : {-1e-9, 1e-9}) {
      const Pose X_WB = X_WA * Pose{Mat3::Identity(), Vec3(2.0 * h + gap, lateral, -lateral)};
      EXPECT_EQ(convex_overlap(box, X_WA, box, X_WB, 0.0), gap < 0.0);
      EXPECT_EQ(convex_overlap(box, X_WA, box, X_WB, 2e-9), true);
    }
  }
}

TEST(ConvexOverlap, CoincidingCentresOverlap) {
  Random random(6);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 stretch(random.log_uniform(1e-6, 1.0), random.log_uniform(1e-3, 1.0),
                       random.log_uniform(1e-3, 1.0));
    const ConvexShape a = ConvexShape::from_points(random.points(stretch, i % 2 == 0));
    const ConvexShape b = ConvexShape::from_points(random.points(stretch.reverse(), i % 3 == 0));
    const Pose X_WA{random.rotation(), random.direction()};
    Pose X_WB{random.rotation(), Vec3::Zero()};
    X_WB.p = X_WA * a.center_B - X_WB.R * b.center_B;
    const double offset = i % 5 == 0 ? 0.0 : random.log_uniform(1e-18, 1e-8);
    X_WB.p += offset * random.direction();
    EXPECT_TRUE(convex_overlap(a, X_WA, b, X_WB, 0.0) || offset > 1e-10) << i;
    EXPECT_TRUE(convex_overlap(a, X_WA, b, X_WB, 1e-8)) << i;
    EXPECT_TRUE(convex_overlap(a, X_WA, a, X_WA, 0.0)) << i;
  }
}

TEST(ConvexOverlap, ShapesWithoutVolumeHaveAVerdict) {
  // Points, segments and polygons, in one plane or not: distances are known, both verdicts are asked for.
  Random random(7);
  const ConvexShape point = ConvexShape::from_points({Vec3(0.1, 0.2, 0.3)});
  const ConvexShape segment = ConvexShape::from_points({{-0.5, 0.0, 0.0}, {0.5, 0.0, 0.0}});
  const ConvexShape square =
      ConvexShape::from_points({{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}});
  for (int i = 0; i < 1000; ++i) {
    const Pose X_WA{random.rotation(), random.direction()};
    const Vec3 inside(random.uniform(-0.45, 0.45), random.uniform(-0.45, 0.45), 0.0);
    const Mat3 turn = Eigen::AngleAxisd(random.uniform(-3.0, 3.0), Vec3::UnitZ()).toRotationMatrix();
    for (const double z : {1e-3, -1e-3}) {
      const Pose X_WS = X_WA * Pose{turn, inside + Vec3(0, 0, z)};
      const Pose X_WP = X_WA * Pose{Mat3::Identity(), inside + Vec3(0, 0, z) - point.vertices.front()};
      for (const double slack : {-1e-6, 1e-6}) {
        const double margin = 1e-3 + slack;
        EXPECT_EQ(convex_overlap(square, X_WA, square, X_WS, margin), slack > 0.0) << i;
        EXPECT_EQ(convex_overlap(square, X_WA, segment, X_WS, margin), slack > 0.0) << i;
        EXPECT_EQ(convex_overlap(square, X_WA, point, X_WP, margin), slack > 0.0) << i;
      }
    }
    // In one plane, crossing by half their size.
    const Pose X_flat = X_WA * Pose{turn, 0.5 * inside};
    EXPECT_TRUE(convex_overlap(square, X_WA, square, X_flat, 1e-6)) << i;
    EXPECT_TRUE(convex_overlap(segment, X_WA, segment, X_WA * Pose{turn, Vec3::Zero()}, 1e-6)) << i;
  }
}

TEST(ConvexOverlap, ShapesOfManyVerticesHaveTheVerdictOfSeparatingAxes) {
  // Two spheres of 2000 points each: apart beyond 0.2 m, and overlapping when closer than the points'
  // polyhedron allows.
  Random random(9);
  std::vector<Vec3> points;
  for (int i = 0; i < 2000; ++i) points.push_back(0.1 * random.direction());
  const ConvexShape sphere = ConvexShape::from_points(points);
  for (int i = 0; i < 1000; ++i) {
    const Pose X_WA{random.rotation(), random.direction()};
    const Vec3 d = random.direction();
    EXPECT_FALSE(convex_overlap(sphere, X_WA, sphere, {random.rotation(), X_WA.p + 0.20001 * d}, 0.0));
    EXPECT_TRUE(convex_overlap(sphere, X_WA, sphere, {random.rotation(), X_WA.p + 0.197 * d}, 0.0));
  }
}

TEST(ConvexOverlap, ExactTouchingIsAnOverlap) {
  const auto box = [](const Vec3& lower, const Vec3& upper) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i)
      corners.emplace_back((i & 1) != 0 ? upper.x() : lower.x(), (i & 2) != 0 ? upper.y() : lower.y(),
                           (i & 4) != 0 ? upper.z() : lower.z());
    return ConvexShape::from_points(corners);
  };
  const ConvexShape table = box({-0.45, -0.35, -0.04}, {0.45, 0.35, 0.0});
  const ConvexShape block = box({-0.11, -0.06, 0.0}, {0.11, 0.06, 0.06});
  ASSERT_TRUE(block.is_box);
  const Pose X_WT{Mat3::Identity(), {0.0, 0.0, 0.7}};
  EXPECT_TRUE(convex_overlap(table, X_WT, block, {Mat3::Identity(), {0.1, -0.05, 0.7}}, 0.0));
  EXPECT_FALSE(convex_overlap(table, X_WT, block, {Mat3::Identity(), {0.1, -0.05, 0.7 + 1e-6}}, 0.0));
  EXPECT_TRUE(convex_overlap(table, X_WT, block, {Mat3::Identity(), {0.1, -0.05, 0.7 + 1e-6}}, 2e-6));
}

TEST(ConvexOverlap, AFarPoseHasNoContactAndANonFinitePoseIsRefused) {
  const ConvexShape shape = ConvexShape::from_points({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  Pose pose;
  for (const double far : {1e20, 1e155, 1e300}) {
    pose.p = Vec3(far, -far, far);
    EXPECT_FALSE(convex_overlap(shape, Pose{}, shape, pose, 0.0)) << far;
  }
  for (const double bad : {std::numeric_limits<double>::infinity(), std::nan("")}) {
    pose.p.x() = bad;
    EXPECT_THROW(convex_overlap(shape, Pose{}, shape, pose, 0.0), std::invalid_argument) << bad;
  }
}

TEST(ConvexHull, TheHullOfAMeshedBoxHasItsEightCorners) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 6; ++i)
    for (int j = 0; j <= 4; ++j)
      for (int k = 0; k <= 5; ++k)
        if (i % 6 == 0 || j % 4 == 0 || k % 5 == 0) points.emplace_back(0.1 * i, 0.07 * j, 0.03 * k);
  const ConvexShape shape = ConvexShape::from_points(convex_hull_vertices(points));
  EXPECT_EQ(shape.vertices.size(), 8U);
  EXPECT_TRUE(shape.is_box);
}

TEST(ConvexHull, EveryPointIsInsideTheHull) {
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    std::vector<Vec3> points;
    for (int k = 0; k < 100; ++k) points.push_back(random.direction() * random.uniform(0.0, 1.0));
    const std::vector<Vec3> hull = convex_hull_vertices(points);
    ASSERT_LT(hull.size(), points.size());
    for (int k = 0; k < 100; ++k) {
      const Vec3 d = random.direction();
      const auto height = [&](const Vec3& p, const Vec3& q) { return d.dot(p) < d.dot(q); };
      EXPECT_DOUBLE_EQ(d.dot(*std::max_element(points.begin(), points.end(), height)),
                       d.dot(*std::max_element(hull.begin(), hull.end(), height)));
    }
  }
}

TEST(ConvexHull, PointsWithoutVolumeAreRejected) {
  EXPECT_THROW(convex_hull_vertices({}), std::invalid_argument);
  EXPECT_THROW(convex_hull_vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), std::invalid_argument);
  EXPECT_THROW(convex_hull_vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}}),
               std::invalid_argument);
  EXPECT_THROW(convex_hull_vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nan("")}}),
               std::invalid_argument);
  EXPECT_THROW(ConvexShape::from_points({}), std::invalid_argument);
  EXPECT_THROW(ConvexShape::from_points({{std::nan(""), 0, 0}}), std::invalid_argument);
}

}  // namespace
}  // namespace takt
