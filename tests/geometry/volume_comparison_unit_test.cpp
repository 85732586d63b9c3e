// Volumes lost and gained by convex parts, against closed forms.
#include "server/geometry/convex/volume_comparison.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tests/support/hollow_bodies.h"

namespace takt::test {
namespace {

constexpr double kRays = 2e-3;  // error of the finite number of rays

ConvexShape shape_of(const TriangleMesh& mesh) {
  return ConvexShape::from_points(convex_hull_vertices(mesh.vertices));
}

TEST(VolumeComparison, AConvexBodyIsItsOwnHull) {
  const TriangleMesh box = box_mesh({0.2, 0.1, 0.3});
  const ConvexShape hull = shape_of(box);
  const VolumeComparison v = compare_volumes(box, {&hull, 1});
  EXPECT_NEAR(v.solid_volume, 0.006, 0.006 * 1e-12);  // every ray sees the same length
  EXPECT_NEAR(v.union_volume, 0.006, 0.006 * 1e-12);
  EXPECT_NEAR(v.error(), 0.0, 1e-12);
}

TEST(VolumeComparison, TheHullOfAUFillsItsPocket) {
  const TriangleMesh u = u_shape();
  const ConvexShape hull = shape_of(u);
  const VolumeComparison v = compare_volumes(u, {&hull, 1});
  EXPECT_NEAR(v.solid_volume / 220e-6, 1.0, kRays);
  EXPECT_NEAR(v.union_volume / 400e-6, 1.0, kRays);
  EXPECT_NEAR(v.gained, 180.0 / 220.0, kRays);
  EXPECT_NEAR(v.lost, 0.0, 1e-12);
}

TEST(VolumeComparison, SharedVolumeCountsOnce) {
  const Vec3 size(0.2, 0.16, 0.10);
  const double wall = 0.012;
  const TriangleMesh box = open_box(size, wall);
  EXPECT_NEAR(volume_properties(box).volume, open_box_volume(size, wall), 1e-15);
  std::vector<ConvexShape> parts;
  for (const TriangleMesh& mesh : open_box_by_hand(size, wall)) parts.push_back(shape_of(mesh));
  parts.push_back(shape_of(box_mesh({0.2, 0.16, 0.012})));  // the floor again
  VolumeComparison v = compare_volumes(box, parts);
  EXPECT_NEAR(v.union_volume / open_box_volume(size, wall), 1.0, kRays);
  EXPECT_NEAR(v.error(), 0.0, 1e-9);
  // Without the floor: its volume is lost, no volume is gained.
  parts.pop_back();
  parts.erase(parts.begin());
  v = compare_volumes(box, parts);
  EXPECT_NEAR(v.lost, size.x() * size.y() * wall / open_box_volume(size, wall), kRays);
  EXPECT_NEAR(v.gained, 0.0, 1e-12);
}

TEST(VolumeComparison, LostAndGainedDoNotCancel) {
  // A unit cube stands for one beside it that it covers by three quarters.
  const TriangleMesh cube = box_mesh({1.0, 1.0, 1.0});
  const ConvexShape beside = shape_of(box_mesh({1.0, 1.0, 1.0}, {0.25, 0.0, 0.0}));
  const VolumeComparison v = compare_volumes(cube, {&beside, 1});
  EXPECT_NEAR(v.union_volume, v.solid_volume, kRays);
  EXPECT_NEAR(v.lost, 0.25, kRays);
  EXPECT_NEAR(v.gained, 0.25, kRays);
}

TEST(VolumeComparison, SlantedFacesHaveTheClosedFormVolume) {
  // A cone of 200 sides in its bounding prism of as many: 1/3 is solid.
  std::vector<std::array<double, 2>> outline;
  std::vector<std::array<std::uint32_t, 3>> cap;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 200.0;
    outline.push_back({0.05 * std::cos(angle), 0.05 * std::sin(angle)});
    if (i > 1) cap.push_back({0, i - 1, i});
  }
  const TriangleMesh cylinder = prism(outline, cap, 0.0, 0.1);
  TriangleMesh cone;
  cone.vertices.assign(cylinder.vertices.begin(), cylinder.vertices.begin() + 200);
  cone.vertices.emplace_back(0.0, 0.0, 0.1);
  for (const auto& t : cap) cone.triangles.push_back({t[0], t[2], t[1]});
  for (std::uint32_t i = 0; i < 200; ++i) cone.triangles.push_back({i, (i + 1) % 200, 200});
  ASSERT_TRUE(check_closed(cone).ok());
  const ConvexShape hull = shape_of(cylinder);
  EXPECT_NEAR(compare_volumes(cone, {&hull, 1}).gained, 2.0, 2.0 * kRays);
  const ConvexShape own = shape_of(cone);
  EXPECT_NEAR(compare_volumes(cone, {&own, 1}).error(), 0.0, 1e-9);
}

TEST(VolumeComparison, RepeatedRunsGiveTheSameBits) {
  const TriangleMesh u = u_shape();
  const ConvexShape hull = shape_of(u);
  EXPECT_EQ(compare_volumes(u, {&hull, 1}).gained, compare_volumes(u, {&hull, 1}).gained);
}

TEST(ConvexHullMesh, TheMeshOfAHullIsClosedAndEnclosesItsVolume) {
  const TriangleMesh hull = convex_hull_mesh(u_shape().vertices);
  // Only corners of the hull are used: merges the list ahead of the check for closedness.
  TriangleMesh used = hull;
  EXPECT_TRUE(check_closed(used).ok()) << check_closed(used).problem;
  EXPECT_NEAR(volume_properties(used).volume, 400e-6, 1e-15);
  EXPECT_THROW(convex_hull_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}), std::invalid_argument);
}

TEST(VolumeComparison, WhatTheOwnHullGainsIsAClosedForm) {
  const TriangleMesh u = u_shape();
  const VolumeComparison v = compare_with_hull(u, shape_of(u));
  EXPECT_NEAR(v.solid_volume, 220e-6, 1e-15);
  EXPECT_NEAR(v.union_volume, 400e-6, 1e-15);
  EXPECT_NEAR(v.gained, 180.0 / 220.0, 1e-9);
  EXPECT_EQ(v.lost, 0.0);
  const TriangleMesh box = box_mesh({0.2, 0.1, 0.3});
  EXPECT_NEAR(compare_with_hull(box, shape_of(box)).gained, 0.0, 1e-12);
  const VolumeComparison by_rays = compare_volumes(u, std::array{shape_of(u)});
  EXPECT_NEAR(v.gained, by_rays.gained, kRays);
}

TEST(VolumeComparison, ShellsInEachOtherCountOnceInTheOwnHull) {
  // Two cubes that share a half: 1.5 of the hull's 1.5.
  TriangleMesh both = box_mesh({1.0, 1.0, 1.0});
  const TriangleMesh other = box_mesh({1.0, 1.0, 1.0}, {0.5, 0.0, 0.0});
  const auto shift = static_cast<std::uint32_t>(both.vertices.size());
  both.vertices.insert(both.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& t : other.triangles) both.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  EXPECT_NEAR(volume_properties(both).volume, 2.0, 1e-12);
  const VolumeComparison v = compare_with_hull(both, shape_of(both));
  EXPECT_NEAR(v.solid_volume, 1.5, 1.5 * kRays);
  EXPECT_NEAR(v.gained, 0.0, kRays);
}

}  // namespace
}  // namespace takt::test
