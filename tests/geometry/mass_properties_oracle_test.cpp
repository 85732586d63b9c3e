// Volume, centre and inertia of meshes against closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {
namespace {

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& t : other.triangles)
    mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
}

TriangleMesh inside_out(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

TriangleMesh box(const Vec3& lower, const Vec3& upper) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back((i & 1) != 0 ? upper.x() : lower.x(), (i & 2) != 0 ? upper.y() : lower.y(),
                               (i & 4) != 0 ? upper.z() : lower.z());
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

TriangleMesh cylinder(double radius, double height, std::uint32_t sides) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, height}};
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / sides;
    mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0.0);
    mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), height);
  }
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t a = 2 + 2 * i;
    const std::uint32_t b = 2 + 2 * ((i + 1) % sides);
    mesh.triangles.push_back({0, b, a});
    mesh.triangles.push_back({1, a + 1, b + 1});
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
  return mesh;
}

Mat3 box_inertia(const Vec3& size) {
  const Vec3 s = size.cwiseProduct(size);
  return Vec3((s.y() + s.z()) / 12.0, (s.z() + s.x()) / 12.0, (s.x() + s.y()) / 12.0).asDiagonal();
}

TEST(MassProperties, ABoxFarFromTheOriginHasItsClosedForm) {
  const Vec3 size(0.22, 0.12, 0.06);
  const Vec3 lower(10.0, -7.0, 3.0);
  const TriangleMesh mesh = box(lower, lower + size);
  ASSERT_TRUE(check_closed(mesh).ok());
  const VolumeProperties p = volume_properties(mesh);
  EXPECT_NEAR(p.volume, size.prod(), 1e-12 * size.prod());
  EXPECT_LT((p.p_BBcm - lower - 0.5 * size).norm(), 1e-12);
  EXPECT_LT((p.G_BBcm_B - box_inertia(size)).norm(), 1e-12 * box_inertia(size).norm() + 1e-15);
}

TEST(MassProperties, ABoxWithAClosedPocketHasItsClosedForm) {
  const Vec3 size(0.22, 0.12, 0.06);
  const Vec3 pocket_size(0.06, 0.08, 0.04);
  const Vec3 pocket_lower(-0.09, -0.04, 0.01);
  TriangleMesh mesh = box({-0.11, -0.06, 0.0}, {0.11, 0.06, 0.06});
  append(mesh, inside_out(box(pocket_lower, pocket_lower + pocket_size)));
  ASSERT_TRUE(check_closed(mesh).ok());
  const double v1 = size.prod();
  const double v2 = -pocket_size.prod();
  const Vec3 c1(0.0, 0.0, 0.03);
  const Vec3 c2 = pocket_lower + 0.5 * pocket_size;
  const Vec3 c = (v1 * c1 + v2 * c2) / (v1 + v2);
  const auto steiner = [&](const Vec3& r) {
    return Mat3(r.squaredNorm() * Mat3::Identity() - r * r.transpose());
  };
  const Mat3 inertia =
      (v1 * (box_inertia(size) + steiner(c1 - c)) + v2 * (box_inertia(pocket_size) + steiner(c2 - c))) /
      (v1 + v2);
  const VolumeProperties p = volume_properties(mesh);
  EXPECT_NEAR(p.volume, v1 + v2, 1e-15);
  EXPECT_LT((p.p_BBcm - c).norm(), 1e-14);
  EXPECT_LT((p.G_BBcm_B - inertia).norm(), 1e-12 * inertia.norm());
}

TEST(MassProperties, ARightTetrahedronHasItsClosedForm) {
  const TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const VolumeProperties p = volume_properties(mesh);
  EXPECT_NEAR(p.volume, 1.0 / 6.0, 1e-15);
  EXPECT_LT((p.p_BBcm - Vec3::Constant(0.25)).norm(), 1e-15);
  // Integral of x^2 over the tetrahedron is V/10, of xy V/20; moved to the centre: 3/80 and -1/80 of V.
  Mat3 expected = Mat3::Constant(1.0 / 80.0);
  expected.diagonal().setConstant(6.0 / 80.0);
  EXPECT_LT((p.G_BBcm_B - expected).norm(), 1e-15);
}

TEST(MassProperties, ACylinderConvergesWithTheSquareOfItsSides) {
  const double r = 0.05;
  const double h = 0.2;
  const double volume = std::numbers::pi * r * r * h;
  const Mat3 inertia = Vec3(r * r / 4 + h * h / 12, r * r / 4 + h * h / 12, r * r / 2).asDiagonal();
  double last_volume_error = 0.0;
  double last_inertia_error = 0.0;
  for (const std::uint32_t sides : {16U, 32U, 64U, 128U}) {
    const TriangleMesh mesh = cylinder(r, h, sides);
    ASSERT_TRUE(check_closed(mesh).ok());
    const VolumeProperties p = volume_properties(mesh);
    // A prism over a regular polygon is exact by itself.
    EXPECT_NEAR(p.volume, 0.5 * sides * r * r * std::sin(2.0 * std::numbers::pi / sides) * h, 1e-15);
    EXPECT_LT((p.p_BBcm - Vec3(0, 0, h / 2)).norm(), 1e-14);
    const double volume_error = volume - p.volume;
    const double inertia_error = (inertia - p.G_BBcm_B).norm();
    if (last_volume_error > 0.0) {
      EXPECT_NEAR(std::log2(last_volume_error / volume_error), 2.0, 0.05);
      EXPECT_NEAR(std::log2(last_inertia_error / inertia_error), 2.0, 0.05);
    }
    last_volume_error = volume_error;
    last_inertia_error = inertia_error;
  }
}

TEST(MassProperties, MassPropertiesMoveWithTheFrame) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  const TriangleMesh mesh = cylinder(0.05, 0.2, 7);
  const VolumeProperties in_b = volume_properties(mesh);
  for (int i = 0; i < 100; ++i) {
    const Pose X_AB{
        Quat(normal(engine), normal(engine), normal(engine), normal(engine)).normalized().toRotationMatrix(),
        Vec3(normal(engine), normal(engine), normal(engine))};
    TriangleMesh moved = mesh;
    for (Vec3& v : moved.vertices) v = X_AB * v;
    const VolumeProperties in_a = volume_properties(moved);
    EXPECT_NEAR(in_a.volume / in_b.volume, 1.0, 1e-9);
    EXPECT_LT((in_a.p_BBcm - X_AB * in_b.p_BBcm).norm(), 1e-9);
    EXPECT_LT((in_a.G_BBcm_B - X_AB.R * in_b.G_BBcm_B * X_AB.R.transpose()).norm(),
              1e-9 * in_b.G_BBcm_B.norm());
  }
}

TEST(MassProperties, InwardFacesGiveANegativeVolumeAndTheSameCentre) {
  const TriangleMesh mesh = box({0, 0, 0}, {1, 2, 3});
  const VolumeProperties p = volume_properties(inside_out(mesh));
  EXPECT_NEAR(p.volume, -6.0, 1e-12);
  EXPECT_LT((p.p_BBcm - Vec3(0.5, 1.0, 1.5)).norm(), 1e-14);
}

}  // namespace
}  // namespace takt
