// Distance, depth and place of boxes and balls against closed forms.
#include <gtest/gtest.h>

#include "server/geometry/convex/rounded_shape.h"

namespace takt {
namespace {

std::vector<RoundedShape> box_shape(const Vec3& half) {
  ConvexShape shape = ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero()));
  shape.become_box(-half, half);
  return {{shape, 0.0}};
}
std::vector<RoundedShape> ball(double radius) {
  return {{ConvexShape::from_points({Vec3::Zero()}), radius}};
}
Pose at(double x, double y, double z) {
  return {Mat3::Identity(), Vec3(x, y, z)};
}
BodyDistance distance(const std::vector<RoundedShape>& a, const Pose& X_WA,
                      const std::vector<RoundedShape>& b, const Pose& X_WB) {
  return body_distance(a, bounds_of(a), X_WA, b, bounds_of(b), X_WB, 100.0);
}

TEST(BodyDistanceOracle, BoxesFaceToFaceAndCornerToCornerHaveTheClosedFormDistance) {
  const auto a = box_shape({0.1, 0.2, 0.3}), b = box_shape({0.2, 0.1, 0.1});
  EXPECT_NEAR(distance(a, at(0, 0, 0), b, at(0.5, 0, 0)).distance_m, 0.2, 1e-10);
  const BodyDistance corner = distance(a, at(0, 0, 0), b, at(0.3 + 0.03, 0.3 + 0.04, 0.4 + 0.12));
  EXPECT_NEAR(corner.distance_m, 0.13, 1e-10);  // 3, 4, 12, 13
  EXPECT_NEAR((corner.p_W - Vec3(0.115, 0.22, 0.36)).norm(), 0.0, 1e-9);
}

TEST(BodyDistanceOracle, DepthAndPlaceOfAnOverlapAreThoseOfTheClosedForm) {
  // A block of 20 mm pushed 3 mm into a table top at z = 0.7.
  const auto table = box_shape({0.45, 0.35, 0.02}), block = box_shape({0.01, 0.01, 0.01});
  const BodyDistance found = distance(table, at(0, 0, 0.68), block, at(0.1, -0.2, 0.7 + 0.01 - 0.003));
  EXPECT_NEAR(found.distance_m, -0.003, 1e-10);
  EXPECT_NEAR(found.p_W.z(), 0.7 - 0.0015, 1e-9);
  EXPECT_LE(std::abs(found.p_W.x() - 0.1), 0.01 + 1e-9);
  EXPECT_LE(std::abs(found.p_W.y() + 0.2), 0.01 + 1e-9);
}

TEST(BodyDistanceOracle, TheDistanceOfBallsIsExact) {
  const auto a = ball(0.05), b = ball(0.02), cube = box_shape({0.1, 0.1, 0.1});
  const BodyDistance apart = distance(a, at(0, 0, 0), b, at(0.06, 0.08, 0));
  EXPECT_NEAR(apart.distance_m, 0.1 - 0.07, 1e-12);
  EXPECT_NEAR((apart.p_W - Vec3(0.6, 0.8, 0) * 0.065).norm(), 0.0, 1e-12);
  EXPECT_NEAR(distance(a, at(0, 0, 0), b, at(0.03, 0.04, 0)).distance_m, 0.05 - 0.07, 1e-12);
  EXPECT_NEAR(distance(cube, at(0, 0, 0), a, at(0.13, 0.14, 0)).distance_m, 0.0, 1e-10);  // an edge: 3, 4, 5
  EXPECT_NEAR(distance(cube, at(0, 0, 0), a, at(0.12, 0, 0)).distance_m, -0.03, 1e-10);
  // The centre of the ball itself inside the cube.
  EXPECT_NEAR(distance(cube, at(0, 0, 0), a, at(0.09, 0, 0)).distance_m, -0.06, 1e-10);
}

TEST(BodyDistanceOracle, BoundsHoldAllShapes) {
  std::vector<RoundedShape> shapes = box_shape({0.1, 0.2, 0.3});
  shapes.push_back({ConvexShape::from_points({Vec3(1.0, 0.0, 0.0)}), 0.25});
  const ShapeBounds bounds = bounds_of(shapes);
  EXPECT_NEAR(bounds.reach_m, 1.25, 1e-12);
  EXPECT_GE(bounds.radius_m + 1e-12, (Vec3(1.25, 0, 0) - bounds.center_B).norm());
  for (const Vec3& v : shapes[0].core.vertices)
    EXPECT_GE(bounds.radius_m + 1e-12, (v - bounds.center_B).norm());
}

}  // namespace
}  // namespace takt
