// Bounding boxes contain all of their points.
#include "server/geometry/aabb.h"

#include <gtest/gtest.h>

#include <random>

namespace takt {
namespace {

TEST(Aabb, OverlapsWhenTouchingInEveryAxis) {
  const Aabb a{{0, 0, 0}, {1, 1, 1}};
  EXPECT_TRUE(a.overlaps({{1, 1, 1}, {2, 2, 2}}));
  EXPECT_TRUE(a.overlaps({{0.2, 0.2, 0.2}, {0.3, 0.3, 0.3}}));
  for (int axis = 0; axis < 3; ++axis) {
    Aabb b = a;
    b.lower[axis] = 1.001;
    b.upper[axis] = 2.0;
    EXPECT_FALSE(a.overlaps(b)) << axis;
    EXPECT_FALSE(b.overlaps(a)) << axis;
  }
}

TEST(BodyBox, TheWorldBoxIsTheTightestOfItsCorners) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  const BodyBox box{{0.1, -0.2, 0.3}, {0.5, 0.05, 1.0}};
  for (int i = 0; i < 1000; ++i) {
    const Pose X_WB = Pose::from_quaternion(
        {normal(engine), normal(engine), normal(engine)},
        Quat(normal(engine), normal(engine), normal(engine), normal(engine)).normalized());
    Vec3 lower = Vec3::Constant(1e300);
    Vec3 upper = -lower;
    for (int k = 0; k < 8; ++k) {
      const Vec3 corner((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
      const Vec3 p = X_WB * (box.center_B + box.half_B.cwiseProduct(corner));
      lower = lower.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
    const Aabb world = box.at(X_WB, 0.01);
    EXPECT_LT((world.lower - (lower - Vec3::Constant(0.01))).norm(), 1e-14);
    EXPECT_LT((world.upper - (upper + Vec3::Constant(0.01))).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace takt
