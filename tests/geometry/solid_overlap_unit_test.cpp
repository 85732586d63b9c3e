// Penetration depths of solids: closed forms, thin walls, pockets, and zero for touching solids.
#include "server/geometry/mesh/solid_overlap.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "tests/support/contact_meshes.h"
#include "tests/support/hollow_bodies.h"

namespace takt {
namespace {

constexpr double kMargin_m = 1e-5;

Pose at(const Vec3& p, double yaw = 0.0) {
  return {rotation_from_rpy({0.0, 0.0, yaw}), p};
}

double both_ways(const TriangleMesh& a, const Pose& X_WA, const TriangleMesh& b, const Pose& X_WB) {
  const SolidProbe probe_a(a), probe_b(b);
  const SolidOverlap one = solid_overlap(probe_a, X_WA, probe_b, X_WB, kMargin_m);
  const SolidOverlap other = solid_overlap(probe_b, X_WB, probe_a, X_WA, kMargin_m);
  EXPECT_NEAR(one.depth_m, other.depth_m, 1e-12);
  return one.depth_m;
}

TEST(SolidOverlap, TheDepthOfABoxInAPlateIsTheClosedForm) {
  const TriangleMesh box = test::box_mesh({0.04, 0.04, 0.04}), plate = test::box_mesh({0.6, 0.4, 0.04});
  std::mt19937 random(7);
  std::uniform_real_distribution<double> depth(2e-5, 0.015), turn(-3.0, 3.0), place(-0.1, 0.1);
  for (int i = 0; i < 50; ++i) {
    const double d = depth(random);
    const Pose X = at({place(random), place(random), 0.04 - d}, turn(random));
    EXPECT_NEAR(both_ways(box, X, plate, Pose{}), d, 1e-9) << i;
  }
}

TEST(SolidOverlap, SolidsThatTouchOrAreApartHaveNoDepth) {
  const TriangleMesh box = test::box_mesh({0.04, 0.04, 0.04}), plate = test::box_mesh({0.6, 0.4, 0.04});
  for (const double gap : {0.0, 1e-6, -1e-6, -9e-6, 0.01, 1.0})
    EXPECT_EQ(both_ways(box, at({0.01, 0.02, 0.04 + gap}, 0.3), plate, Pose{}), 0.0) << gap;
}

TEST(SolidOverlap, ARodThroughAThinPlateIsFound) {
  const TriangleMesh rod = test::box_mesh({0.01, 0.01, 0.3});
  for (const double thickness : {0.0005, 0.002, 0.005}) {
    const TriangleMesh plate = test::box_mesh({0.6, 0.4, thickness});
    const double depth = both_ways(rod, at({0.0713, 0.0317, -0.1}, 0.2), plate, Pose{});
    // At least half of half the plate, where an edge of the divided rod ends in it; up to half the rod, where
    // an edge of the divided plate runs in it.
    EXPECT_GE(depth, 0.25 * thickness);
    EXPECT_LE(depth, 0.005);
  }
}

TEST(SolidOverlap, ASolidInAPocketHasNoDepth) {
  // The U's pocket is 60 mm wide and 60 mm deep above its floor of 20 mm.
  const TriangleMesh u = test::u_shape();
  const TriangleMesh guest = test::box_mesh({0.0599, 0.06, 0.05});
  EXPECT_EQ(both_ways(guest, at({0.05, 0.05, 0.0}), u, Pose{}), 0.0);
  EXPECT_NEAR(both_ways(guest, at({0.05, 0.047, 0.0}), u, Pose{}), 0.003, 1e-9) << "3 mm into the floor";
}

TEST(SolidOverlap, ASolidInsideAnotherIsAsDeepAsItsDeepestPoint) {
  const TriangleMesh small = test::box_mesh({0.01, 0.01, 0.01}), large = test::box_mesh({0.2, 0.2, 0.2});
  EXPECT_NEAR(both_ways(small, at({0.0, 0.0, 0.05}), large, Pose{}), 0.06, 1e-9);
}

TEST(SolidOverlap, TheDepthOfBallsIsCloseToTheClosedForm) {
  const TriangleMesh ball = test::ball(0.02, 4);
  for (const double apart : {0.039, 0.035, 0.03}) {
    const double depth = both_ways(ball, at({0.0, 0.0, 0.0}), ball, at({0.6 * apart, 0.0, 0.8 * apart}, 0.4));
    EXPECT_LE(depth, 0.04 - apart);
    EXPECT_GE(depth, 0.9 * (0.04 - apart) - 1e-4);
  }
}

}  // namespace
}  // namespace takt
