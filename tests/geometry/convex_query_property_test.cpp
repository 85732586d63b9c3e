// Queries with a memory (ConvexHint) against queries without: the verdicts must be the same after any earlier
// queries, in coherent motion, after jumps, and within micrometres of touching.
#include "server/geometry/convex/query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/convex_oracle.h"
#include "tests/support/effort.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::Random;

int number_of_queries() {
  return 20'000 * static_cast<int>(test::effort());
}

/// Points on an ellipsoid: all of them are corners of its hull.
std::vector<Vec3> ellipsoid(Random& random, int count, const Vec3& half) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(half.cwiseProduct(random.direction()));
  return points;
}

ConvexShape random_shape(Random& random) {
  switch (random.integer(0, 4)) {
    case 0:
      return ConvexShape::from_points(random.points(Vec3(0.1, 0.2, 0.15), true));
    case 1:
      return ConvexShape::from_points(random.points(Vec3(0.2, 0.2, 0.2), false));
    case 2:
      return ConvexShape::from_points(ellipsoid(random, 64, Vec3(0.1, 0.05, 0.15)));
    case 3:
      return ConvexShape::from_points(ellipsoid(random, 300, Vec3(0.1, 0.1, 0.002)));
    default:
      return ConvexShape::from_points(
          random.points(Vec3(random.log_uniform(1e-5, 0.2), random.log_uniform(1e-5, 0.2), 0.3), false));
  }
}

struct QueryTally {
  long queries = 0, overlapping = 0, wrong = 0;
  QueryCounts counts;
};

void ask(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB, double margin,
         ConvexHint& hint, QueryTally& tally) {
  const bool plain = convex_overlap(a, X_WA, b, X_WB, margin);
  const bool verdict = convex_overlap(a, X_WA, b, X_WB, margin, hint, tally.counts);
  ++tally.queries;
  tally.overlapping += plain ? 1 : 0;
  if (plain != verdict && ++tally.wrong <= 5)
    ADD_FAILURE() << "query " << tally.queries << ": without memory " << plain << ", with " << verdict
                  << ", margin " << margin << ", vertices " << a.vertices.size() << " and "
                  << b.vertices.size();
}

void report_queries(const char* name, const QueryTally& tally) {
  std::cout << name << ": " << tally.queries << " queries, " << tally.overlapping << " overlapping, by hint "
            << tally.counts.by_hint << ", by search " << tally.counts.by_search << ", by MPR "
            << tally.counts.by_mpr << ", wrong " << tally.wrong << "\n";
  ::testing::Test::RecordProperty(std::string(name) + "_queries", static_cast<int>(tally.queries));
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.overlapping, tally.queries / 20);
  EXPECT_LT(tally.overlapping, tally.queries * 19 / 20);
}

double random_margin(Random& random) {
  switch (random.integer(0, 2)) {
    case 0:
      return 0.0;
    case 1:
      return 2e-4;
    default:
      return random.log_uniform(1e-9, 1e-2);
  }
}

TEST(ConvexQuery, CoherentMotionHasTheVerdictsOfIndependentQueries) {
  Random random(21);
  QueryTally tally;
  while (tally.queries < number_of_queries()) {
    const ConvexShape a = random_shape(random);
    const ConvexShape b = random_shape(random);
    const double margin = random_margin(random);
    ConvexHint hint;
    // b swings through a and out again, both turning, in steps from micrometres to centimetres.
    Pose X_WA{random.rotation(), random.direction()};
    Pose X_WB{random.rotation(), Vec3::Zero()};
    const auto between = [&] { return Vec3(X_WA * a.center_B - X_WB * b.center_B); };
    X_WB.p = between() + random.uniform(0.0, 0.25) * random.direction();
    const double stride = random.log_uniform(1e-6, 2e-2);
    Vec3 velocity = stride * (between().normalized() + 0.3 * random.direction());
    const Vec3 axis_a = random.direction(), axis_b = random.direction();
    for (int i = 0; i < 200; ++i) {
      ask(a, X_WA, b, X_WB, margin, hint, tally);
      X_WB.p += velocity;
      if (between().norm() > 0.25) velocity = stride * between().normalized();
      X_WB.R = Eigen::AngleAxisd(2.0 * stride, axis_b) * X_WB.R;
      X_WA.R = Eigen::AngleAxisd(stride, axis_a) * X_WA.R;
      if (i % 3 == 0) continue;  // both move together for some steps, too
      const Pose step{Eigen::AngleAxisd(10.0 * stride, axis_b).toRotationMatrix(), velocity};
      X_WA = step * X_WA;
      X_WB = step * X_WB;
    }
  }
  report_queries("coherent", tally);
  // The memory must be effective, else this test has no significance.
  EXPECT_GT(tally.counts.by_hint, static_cast<std::uint64_t>(tally.queries) / 2);
}

TEST(ConvexQuery, JumpsAndForeignHintsChangeNoVerdict) {
  Random random(22);
  QueryTally tally;
  while (tally.queries < number_of_queries()) {
    const ConvexShape a = random_shape(random);
    const ConvexShape b = random_shape(random);
    ConvexHint hint;
    for (int i = 0; i < 50; ++i) {
      const Pose X_WA{random.rotation(), random.direction()};
      const Pose X_WB{random.rotation(), X_WA.p + random.uniform(0.0, 0.3) * random.direction()};
      ask(a, X_WA, b, X_WB, random_margin(random), hint, tally);
    }
  }
  report_queries("jumps", tally);
}

TEST(ConvexQuery, NearTouchingTheVerdictsAreThoseOfIndependentQueries) {
  // Distances within 1e-3 to 1e-12 m of the margin, approached from hints of both kinds.
  Random random(23);
  QueryTally tally;
  while (tally.queries < number_of_queries() / 4) {
    const auto pa = random.points(Vec3(0.1, 0.2, 0.15), random.integer(0, 1) == 1);
    const auto pb = random.points(Vec3(0.2, 0.1, 0.1), random.integer(0, 1) == 1);
    const ConvexShape a = ConvexShape::from_points(pa);
    const ConvexShape b = ConvexShape::from_points(pb);
    const Pose X_WA{random.rotation(), random.direction()};
    Pose X_WB{random.rotation(), X_WA.p + 0.2 * random.direction()};
    std::vector<Vec3> wa, wb;
    for (const Vec3& p : pa) wa.push_back(X_WA * p);
    for (const Vec3& p : pb) wb.push_back(X_WB * p);
    const test::Gap gap = test::separating_gap(wa, wb);
    const Vec3 start = X_WB.p - gap.axis * gap.value;  // touching here
    const double margin = random_margin(random);
    ConvexHint hint;
    for (int i = 0; i < 40; ++i) {
      const double sign = random.integer(0, 1) == 1 ? 1.0 : -1.0;
      X_WB.p = start + gap.axis * (margin + sign * random.log_uniform(1e-12, 1e-3));
      ask(a, X_WA, b, X_WB, margin, hint, tally);
    }
  }
  report_queries("near_touching", tally);
}

TEST(ConvexQuery, TheMemoryAnswersForRestingPairs) {
  // A block on a table, then carried along: after the first query no search is needed.
  Random random(24);
  const ConvexShape table = ConvexShape::from_points(random.points(Vec3(0.9, 0.7, 0.04), true));
  const ConvexShape block = ConvexShape::from_points(random.points(Vec3(0.1, 0.2, 0.05), true));
  Pose X_WT{random.rotation(), random.direction()};
  const Vec3 top = table.box.center_B + Vec3(0.1, 0.1, table.box.half_B.z());
  const Vec3 bottom = block.box.center_B - Vec3(0.0, 0.0, block.box.half_B.z());
  Pose X_TB{Eigen::AngleAxisd(0.3, Vec3::UnitZ()).toRotationMatrix(), Vec3::Zero()};
  X_TB.p = top - X_TB.R * bottom;
  ConvexHint hint;
  QueryCounts counts;
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(convex_overlap(table, X_WT, block, X_WT * X_TB, 2e-4, hint, counts));
    X_WT =
        Pose{Eigen::AngleAxisd(0.01, Vec3(0.6, 0.0, 0.8)).toRotationMatrix(), Vec3(1e-3, 2e-3, 0.0)} * X_WT;
  }
  EXPECT_EQ(counts.by_hint, 999U);
  EXPECT_EQ(counts.by_search, 1U);
}

TEST(ConvexQuery, NonFinitePosesAreRefusedAndLeaveNoTrace) {
  Random random(25);
  const ConvexShape a = ConvexShape::from_points(ellipsoid(random, 64, Vec3(0.1, 0.1, 0.1)));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ConvexHint hint;
    QueryCounts counts;
    Pose X_WB;
    X_WB.p.x() = bad;
    EXPECT_THROW(convex_overlap(a, Pose{}, a, X_WB, 1e-4, hint, counts), std::invalid_argument);
    EXPECT_TRUE(convex_overlap(a, Pose{}, a, Pose{}, 1e-4, hint, counts));
    EXPECT_THROW(convex_overlap(a, Pose{}, a, X_WB, 1e-4, hint, counts), std::invalid_argument);
    X_WB.p.x() = 1.0;
    EXPECT_FALSE(convex_overlap(a, Pose{}, a, X_WB, 1e-4, hint, counts));
  }
}

TEST(HullGraph, ClimbingFindsTheHighestVertex) {
  Random random(26);
  int with_graph = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<Vec3> points =
        ellipsoid(random, random.integer(17, 600),
                  Vec3(random.log_uniform(1e-4, 1.0), random.log_uniform(1e-2, 1.0), 0.5));
    if (i % 3 == 0) {  // a meshed box: many points in one plane, and inside
      points.clear();
      for (int x = 0; x <= 4; ++x)
        for (int y = 0; y <= 3; ++y)
          for (int z = 0; z <= 3; ++z) points.emplace_back(0.1 * x, 0.07 * y, 0.03 * z);
      points.emplace_back(0.2, 0.1, 0.15);
    }
    const ConvexShape shape = ConvexShape::from_points(points);
    with_graph += shape.graph.empty() ? 0 : 1;
    std::uint32_t vertex = ConvexShape::kNoVertex, other = ConvexShape::kNoVertex;
    for (int k = 0; k < 100; ++k) {
      const Vec3 d = k % 4 == 0 ? Vec3(Vec3::Unit(k % 3)) : random.direction();
      double highest = -std::numeric_limits<double>::infinity();
      for (const Vec3& p : points) highest = std::max(highest, d.dot(p));
      EXPECT_NEAR(d.dot(shape.extreme_point(d, vertex)), highest, 1e-12);
      EXPECT_NEAR(shape.extreme_height(d, other), highest, 1e-12);
      other = k % 10 == 0 ? ConvexShape::kNoVertex : other;
    }
  }
  EXPECT_GT(with_graph, 250);
}

TEST(HullGraph, ShapesWithoutAGraphAreScanned) {
  Random random(27);
  std::vector<Vec3> flat;
  for (int i = 0; i < 30; ++i) flat.emplace_back(random.uniform(0, 1), random.uniform(0, 1), 0.0);
  EXPECT_TRUE(ConvexShape::from_points(flat).graph.empty());
  std::vector<Vec3> close = ellipsoid(random, 30, Vec3::Ones());
  close.push_back((close.front() + 1e-6 * close.front().unitOrthogonal()).normalized());
  EXPECT_TRUE(ConvexShape::from_points(close).graph.empty());
  EXPECT_TRUE(ConvexShape::from_points(random.points(Vec3::Ones(), true)).graph.empty());
}

}  // namespace
}  // namespace takt
