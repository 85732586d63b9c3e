// Known traps of collision libraries: every query ends, with the geometric verdict or with a refusal. The
// time limit of the test would end a hang.
#include "tests/support/degenerate_cases.h"

#include <gtest/gtest.h>

#include <iostream>
#include <stdexcept>

#include "server/contact/collision/collision_world.h"
#include "server/geometry/convex/distance.h"
#include "server/geometry/convex/query.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"

namespace takt {
namespace {

using test::DegenerateCase;
using test::DegenerateCases;
using Expected = DegenerateCase::Expected;

/// Result of a kind of query in a case.
template <typename Query>
Expected outcome(const Query& query) {
  try {
    return query() ? Expected::touching : Expected::apart;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()), "");
    return Expected::refused;
  }
}

TEST(DegenerateCases, EveryQueryHasTheGeometricVerdictOrIsRefused) {
  const DegenerateCases list;
  int of_kind[3] = {};
  QueryCounts counts;
  for (const DegenerateCase& c : list.all()) {
    SCOPED_TRACE(c.name);
    ++of_kind[static_cast<int>(c.expected)];
    const ConvexShape a = ConvexShape::from_points(c.a), b = ConvexShape::from_points(c.b);
    EXPECT_EQ(outcome([&] { return convex_overlap(a, c.X_WA, b, c.X_WB, c.margin); }), c.expected) << "MPR";
    EXPECT_EQ(outcome([&] { return convex_overlap(b, c.X_WB, a, c.X_WA, c.margin); }), c.expected)
        << "swapped";
    ConvexHint hint;
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(outcome([&] { return convex_overlap(a, c.X_WA, b, c.X_WB, c.margin, hint, counts); }),
                c.expected)
          << "with memory, time " << i;
    // With the hint of a quite different pose, far away and inside one another.
    for (const double away : {10.0, 0.0}) {
      ConvexHint other;
      const Vec3 between = c.X_WA.p.allFinite() && c.X_WA.R.allFinite() ? c.X_WA.p : Vec3::Zero();
      const double margin = c.margin >= 0.0 && c.margin < 1.0 ? c.margin : 0.0;
      const Pose X_WA{Mat3::Identity(), between},
          X_WB{Mat3::Identity(), between + Vec3(away * (a.radius + b.radius), 0, 0)};
      for (int i = 0; i < 2; ++i) convex_overlap(a, X_WA, b, X_WB, margin, other, counts);
      EXPECT_EQ(outcome([&] { return convex_overlap(a, c.X_WA, b, c.X_WB, c.margin, other, counts); }),
                c.expected)
          << "with memory from elsewhere, " << away;
    }
  }
  std::cout << list.all().size() << " cases: " << of_kind[0] << " apart, " << of_kind[1] << " touching, "
            << of_kind[2] << " to be refused; answered by hint " << counts.by_hint << ", by search "
            << counts.by_search << ", by MPR " << counts.by_mpr << "\n";
  EXPECT_GE(list.all().size(), 200U);
  EXPECT_GE(of_kind[0] + of_kind[1], 200);
  EXPECT_GT(of_kind[0], 50);
  EXPECT_GT(of_kind[1], 50);
  EXPECT_GT(of_kind[2], 50);
}

TEST(DegenerateCases, TheDistanceAgreesWithTheVerdictOrIsRefused) {
  const DegenerateCases list;
  for (const DegenerateCase& c : list.all()) {
    SCOPED_TRACE(c.name);
    const ConvexShape a = ConvexShape::from_points(c.a), b = ConvexShape::from_points(c.b);
    const bool bad_pose =
        !(c.X_WA.p.allFinite() && c.X_WA.R.allFinite() && c.X_WB.p.allFinite() && c.X_WB.R.allFinite());
    const bool too_far = !bad_pose && c.X_WB.p.norm() > 1e149;  // also an infinite norm
    if (bad_pose || too_far) {
      EXPECT_THROW(convex_distance(a, c.X_WA, b, c.X_WB), std::invalid_argument);
      continue;
    }
    if (c.expected == Expected::refused) continue;  // its margin is wrong, which the distance has not
    const ConvexDistance found = convex_distance(a, c.X_WA, b, c.X_WB);
    const double slack =
        1e-8 * (a.radius + b.radius + c.margin) + 1e-15 * (c.X_WA.p.norm() + a.reach + b.reach);
    if (c.expected == Expected::apart)
      EXPECT_GT(found.distance, c.margin - slack);
    else
      EXPECT_LT(found.distance, c.margin + slack);
    EXPECT_NEAR(found.normal_W.norm(), 1.0, 1e-9);
  }
}

TEST(DegenerateCases, TheCollisionWorldRefusesNonFinitePosesAndKeepsTheLastOne) {
  const DegenerateCases list;
  int refused = 0;
  for (const DegenerateCase& c : list.all()) {
    SCOPED_TRACE(c.name);
    if (!(c.margin >= 0.0 && c.margin < 1.0)) continue;
    std::vector<Component> components(2);
    components[0].convex = {ConvexShape::from_points(c.a)};
    components[1].convex = {ConvexShape::from_points(c.b)};
    for (const bool remember : {true, false}) {
      CollisionWorld world(components, c.margin, remember);
      DetectionCounts counts;
      const bool taken_a = world.set_pose(0, c.X_WA), taken_b = world.set_pose(1, c.X_WB);
      EXPECT_EQ(taken_a && taken_b, c.expected != Expected::refused);
      if (c.expected == Expected::refused) {
        ++refused;
        continue;
      }
      PairVerdict verdict;
      ASSERT_TRUE(update_verdict(world, 0, 1, verdict, counts));
      EXPECT_EQ(verdict.touching, c.expected == Expected::touching);
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(DegenerateCases, PointsWithoutAHullAreRefusedWithAReason) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  std::vector<std::pair<std::string, std::vector<Vec3>>> cases = {
      {"nothing", {}},
      {"a point", {{1, 2, 3}}},
      {"a segment", {{0, 0, 0}, {1, 0, 0}}},
      {"a triangle", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
      {"four points in a plane", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}},
      {"a tilted plane", {{0, 0, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 2}, {2, 1, 3}}},
      {"points on a line", {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {4, 4, 4}}},
      {"coincident points", std::vector<Vec3>(10, Vec3(0.1, 0.2, 0.3))},
      {"two places", {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 0, 0}}},
      {"NaN", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, nan}}},
      {"infinity", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, inf}}},
      {"thinner than rounding", DegenerateCases::box(1.0, 1.0, 1e-17)},
      {"far away and tiny", {{1e9, 0, 0}, {1e9 + 1e-8, 0, 0}, {1e9, 1e-8, 0}, {1e9, 0, 1e-8}}},
  };
  for (const auto& [name, points] : cases) {
    SCOPED_TRACE(name);
    try {
      convex_hull_vertices(points);
      ADD_FAILURE() << "not refused";
    } catch (const std::invalid_argument& error) {
      EXPECT_GT(std::string(error.what()).size(), 20U);
    }
  }
  // Thin, but not degenerate: all corners are kept.
  for (const double thin : {1e-3, 1e-6, 1e-9, 1e-12})
    EXPECT_EQ(convex_hull_vertices(DegenerateCases::box(1.0, 1.0, thin)).size(), 8U) << thin;
}

TEST(DegenerateCases, ASimulationStopsAtANonFinitePoseAndNamesIt) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    test::BoxCell cell;
    cell.ground("T", {1.0, 1.0, 0.05}, test::at(0.0, 0.0, -0.05));
    cell.part("good", 0.2, 3, {0.04, 0.04, 0.04}, test::at(0.1, 0.0, 0.0));
    cell.part("lost", 0.2, 3, {0.04, 0.04, 0.04}, test::at(0.0, bad, 0.0));
    Simulation simulation(cell.build());
    EXPECT_FALSE(simulation.step({}));
    EXPECT_NE(simulation.fault().find("the pose of lost became non-finite"), std::string::npos)
        << simulation.fault();
    EXPECT_FALSE(simulation.step({}));
  }
}

}  // namespace
}  // namespace takt
