// Refinement preserves the mesh: closed, same volume, area and centre, every point on the old surface; and it
// reaches its goal: no edge too long.
#include "server/geometry/mesh/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "server/geometry/mesh/import.h"

namespace takt {
namespace {

using Generator = std::mt19937_64;

double uniform(Generator& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}

/// A star-shaped body: an octahedron cut up three times, its corners moved in and out at random and
/// stretched differently along the axes, away from the origin.
TriangleMesh random_star(Generator& g) {
  TriangleMesh mesh;
  mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  mesh = refine_to_edge(mesh, uniform(g, 0.3, 1.5));
  const Vec3 stretch(uniform(g, 0.01, 0.3), uniform(g, 0.01, 0.3), uniform(g, 0.01, 0.3));
  const Vec3 away(uniform(g, -1, 1), uniform(g, -1, 1), uniform(g, -1, 1));
  for (Vec3& v : mesh.vertices) v = away + stretch.cwiseProduct(uniform(g, 0.7, 1.3) * v.normalized());
  return mesh;
}

double area(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles)
    sum +=
        0.5 *
        (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).norm();
  return sum;
}

double smallest_angle(const TriangleMesh& mesh) {
  double smallest = 4.0;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]];
      const Vec3 b = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[t[k]];
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return smallest;
}

TEST(MeshRefinement, RandomBodiesKeepTheirShapeWithShortEdges) {
  Generator g(51);
  for (int run = 0; run < 60; ++run) {
    SCOPED_TRACE(run);
    const TriangleMesh before = random_star(g);
    ASSERT_EQ(check_closed(before).problem, "");
    const double edge = longest_edge(before) * uniform(g, 0.05, 1.1);
    const TriangleMesh after = refine_to_edge(before, edge);
    EXPECT_EQ(check_closed(after).problem, "");
    EXPECT_LE(longest_edge(after), edge);
    const VolumeProperties v = volume_properties(before), w = volume_properties(after);
    EXPECT_NEAR(w.volume / v.volume, 1.0, 1e-12);
    EXPECT_LT((w.p_BBcm - v.p_BBcm).norm(), 1e-13);
    EXPECT_LT((w.G_BBcm_B - v.G_BBcm_B).norm(), 1e-11 * v.G_BBcm_B.norm());
    EXPECT_NEAR(area(after) / area(before), 1.0, 1e-12);
    EXPECT_GE(smallest_angle(after), 0.5 * smallest_angle(before) * (1 - 1e-9));
    for (std::size_t i = 0; i < before.vertices.size(); ++i) ASSERT_EQ(after.vertices[i], before.vertices[i]);
    if (edge >= longest_edge(before)) {
      EXPECT_EQ(after.triangles, before.triangles);
    }
  }
}

TEST(MeshRefinement, TheSameMeshGivesTheSameBits) {
  Generator g(52);
  const TriangleMesh mesh = random_star(g);
  const double edge = 0.1 * longest_edge(mesh);
  const TriangleMesh a = refine_to_edge(mesh, edge), b = refine_to_edge(mesh, edge);
  EXPECT_EQ(a.triangles, b.triangles);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t i = 0; i < a.vertices.size(); ++i) EXPECT_EQ(a.vertices[i], b.vertices[i]);
}

TEST(MeshRefinement, OnlyFacesInsideTheRegionAreRefined) {
  Generator g(53);
  for (int run = 0; run < 40; ++run) {
    SCOPED_TRACE(run);
    const TriangleMesh before = random_star(g);
    RefinementOptions options;
    options.edge_m = longest_edge(before) * uniform(g, 0.03, 0.5);
    const Vec3 corner = before.vertices[g() % before.vertices.size()];
    const Vec3 half = Vec3::Constant(uniform(g, 0.01, 0.05));
    options.region = Aabb{corner - half, corner + half};
    const TriangleMesh after = refine_to_edge(before, options);
    EXPECT_EQ(check_closed(after).problem, "");
    EXPECT_NEAR(volume_properties(after).volume / volume_properties(before).volume, 1.0, 1e-12);
    EXPECT_GE(smallest_angle(after), 0.5 * smallest_angle(before) * (1 - 1e-9));
    std::size_t inside = 0;
    for (const auto& t : after.triangles) {
      const Vec3 &a = after.vertices[t[0]], &b = after.vertices[t[1]], &c = after.vertices[t[2]];
      if (!options.region->overlaps({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)})) continue;
      ++inside;
      EXPECT_LE(std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}), options.edge_m);
    }
    EXPECT_GT(inside, 0U);
    EXPECT_LT(after.triangles.size(), refine_to_edge(before, options.edge_m).triangles.size());
  }
}

TEST(MeshRefinement, ASquareIsCutIntoSimilarTriangles) {
  // Cut along a diagonal: bisection gives right isosceles triangles again, so the count is exact.
  TriangleMesh square;
  square.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(refine_to_edge(square, 0.36).triangles.size(), 32U);  // 2 * 2^4, longest edge sqrt(2) / 2^2
  EXPECT_EQ(refine_to_edge(square, 0.35).triangles.size(), 64U);
  EXPECT_EQ(refine_to_edge(square, 1.5).triangles.size(), 2U);
}

TEST(MeshRefinement, TheTableOfTheBlockScenarioIsRefinedToTenMillimetres) {
  const TriangleMesh table = import_solid(std::string(TAKT_CONFIG_DIR) + "/meshes/table.obj");
  const TriangleMesh fine = refine_to_edge(table, 0.01);
  EXPECT_EQ(check_closed(fine).problem, "");
  EXPECT_LE(longest_edge(fine), 0.01);
  EXPECT_NEAR(volume_properties(fine).volume, 0.0318, 1e-12);
  EXPECT_LT(static_cast<double>(fine.triangles.size()), 2.5 * area(table) / (0.5 * 0.01 * 0.01 / 2.0));
}

TEST(MeshRefinement, MeshesThatCannotBeRefinedAreRefused) {
  const TriangleMesh mesh = import_solid(std::string(TAKT_CONFIG_DIR) + "/meshes/P.obj");
  for (const double edge : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(refine_to_edge(mesh, edge), std::invalid_argument);
  RefinementOptions small;
  small.edge_m = 1e-5;
  small.max_triangles = 10000;
  try {
    refine_to_edge(mesh, small);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("more than 10000 triangles"), std::string::npos);
  }
  TriangleMesh three = mesh;
  three.triangles.push_back(three.triangles.front());
  EXPECT_THROW(refine_to_edge(three, 0.001), std::invalid_argument);
  TriangleMesh twice = mesh;
  twice.triangles.front()[1] = twice.triangles.front()[0];
  EXPECT_THROW(refine_to_edge(twice, 0.001), std::invalid_argument);
  TriangleMesh missing = mesh;
  missing.triangles.front()[1] = static_cast<std::uint32_t>(mesh.vertices.size());
  EXPECT_THROW(refine_to_edge(missing, 0.001), std::invalid_argument);
}

}  // namespace
}  // namespace takt
