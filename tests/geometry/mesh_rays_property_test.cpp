// Rays and boxes against meshes: all triangles one by one, and the closed form of a torus.
#include "server/geometry/mesh/mesh_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace takt {
namespace {

/// A torus around the z axis.
TriangleMesh torus(double radius, double tube, std::uint32_t around, std::uint32_t across) {
  TriangleMesh mesh;
  const double turn = 2.0 * std::numbers::pi;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double a = turn * i / around, b = turn * j / across;
      mesh.vertices.emplace_back((radius + tube * std::cos(b)) * std::cos(a),
                                 (radius + tube * std::cos(b)) * std::sin(a), tube * std::sin(b));
    }
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const std::uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      const std::uint32_t a = i * across + j, b = i1 * across + j, c = i1 * across + j1, d = i * across + j1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

Vec3 within(std::mt19937_64& random, double reach) {
  std::uniform_real_distribution<double> one(-reach, reach);
  const double x = one(random), y = one(random), z = one(random);
  return {x, y, z};
}

/// The share of the segment at its first triangle: by the plane and by signed areas.
double first_hit_one_by_one(const TriangleMesh& mesh, const Vec3& p, const Vec3& q) {
  double first = 2.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &A = mesh.vertices[a], &B = mesh.vertices[b], &C = mesh.vertices[c];
    const Vec3 n = (B - A).cross(C - A);
    const double across = n.dot(q - p);
    if (across == 0.0) continue;
    const double share = n.dot(A - p) / across;
    if (share < 0.0 || share > 1.0 || share >= first) continue;
    const Vec3 x = p + share * (q - p);
    if (n.dot((B - A).cross(x - A)) >= 0.0 && n.dot((C - B).cross(x - B)) >= 0.0 &&
        n.dot((A - C).cross(x - C)) >= 0.0)
      first = share;
  }
  return first;
}

/// Signed distance to the smooth torus.
double torus_distance(const Vec3& p, double radius, double tube) {
  return std::hypot(std::hypot(p.x(), p.y()) - radius, p.z()) - tube;
}

TEST(MeshRays, TheFirstHitIsThatOfAllTrianglesOneByOne) {
  const TriangleMesh mesh = torus(0.1, 0.04, 60, 31);
  const MeshRays rays(mesh);
  std::mt19937_64 random(1);
  int hits = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 p = within(random, 0.2), q = within(random, 0.2);
    const double expected = first_hit_one_by_one(mesh, p, q), found = rays.first_hit(p, q);
    ASSERT_EQ(found <= 1.0, expected <= 1.0) << i;
    if (expected > 1.0) continue;
    ++hits;
    ASSERT_NEAR(found, expected, 1e-9) << i;
  }
  EXPECT_GT(hits, 500);
}

TEST(MeshRays, PointsAreInsideWhereTheClosedFormSaysSo) {
  const MeshRays rays(torus(0.1, 0.04, 200, 100));
  std::mt19937_64 random(2);
  int inside = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 p = within(random, 0.15);
    const double distance = torus_distance(p, 0.1, 0.04);
    if (std::abs(distance) < 1e-4) continue;  // between facets and the smooth surface
    ASSERT_EQ(rays.contains(p), distance < 0.0) << p.transpose();
    inside += distance < 0.0 ? 1 : 0;
  }
  EXPECT_GT(inside, 300);
}

TEST(MeshRays, ASegmentInsideTheSolidMeetsIt) {
  const MeshRays rays(torus(0.1, 0.04, 60, 31));
  EXPECT_TRUE(rays.meets_segment({0.09, 0.001, 0.0}, {0.11, 0.002, 0.001}));
  EXPECT_EQ(rays.first_hit({0.09, 0.001, 0.0}, {0.11, 0.002, 0.001}), 2.0);
  EXPECT_FALSE(rays.meets_segment({0.001, 0.0, -1.0}, {0.0, 0.002, 1.0})) << "through the hole";
}

TEST(MeshRays, BoxesMeetTheSolidWherePointsOfBothCoincide) {
  constexpr double kTube = 0.04, kRadius = 0.1;
  const MeshRays rays(torus(kRadius, kTube, 200, 100));
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> size(0.002, 0.03);
  int meets = 0, apart = 0;
  for (int i = 0; i < 1500; ++i) {
    const Vec3 w = within(random, 1.0);
    const Pose X_BV{Eigen::AngleAxisd(2.0 * w.norm(), w.normalized()).toRotationMatrix(),
                    within(random, 0.18)};
    const Vec3 half(size(random), size(random), size(random));
    // The least distance of the torus over a grid of the box, which bounds that of the whole box.
    double least = 1.0;
    constexpr int kGrid = 12;
    for (int a = 0; a <= kGrid; ++a)
      for (int b = 0; b <= kGrid; ++b)
        for (int c = 0; c <= kGrid; ++c) {
          const Vec3 at = (Vec3(a, b, c) * (2.0 / kGrid) - Vec3::Ones()).cwiseProduct(half);
          least = std::min(least, torus_distance(X_BV * at, kRadius, kTube));
        }
    const double between = half.norm() / kGrid;  // from any point of the box to the grid, at most
    if (least < -1e-4) {
      ASSERT_TRUE(rays.meets_box(X_BV, half)) << i;
      ++meets;
    } else if (least > between + 1e-4) {
      ASSERT_FALSE(rays.meets_box(X_BV, half)) << i;
      ++apart;
    }
  }
  EXPECT_GT(meets, 200);
  EXPECT_GT(apart, 200);
}

TEST(MeshRays, ABoxAroundTheWholeSolidAndOneInsideItMeetIt) {
  const MeshRays rays(torus(0.1, 0.04, 60, 31));
  EXPECT_TRUE(rays.meets_box({Mat3::Identity(), Vec3::Zero()}, Vec3::Constant(1.0)));
  EXPECT_TRUE(rays.meets_box({Mat3::Identity(), Vec3(0.1, 0.0, 0.0)}, Vec3::Constant(0.005)));
  EXPECT_FALSE(rays.meets_box({Mat3::Identity(), Vec3::Zero()}, Vec3::Constant(0.03))) << "in the hole";
}

}  // namespace
}  // namespace takt
