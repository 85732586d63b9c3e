// Surfaces with holes of known shape, closed again.
#include "server/product/fill_holes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace takt::product {
namespace {

/// A cylinder of height 1 and radius 1 whose covers are fans of `sides` triangles; without the upper cover if `open`.
TriangleMesh cup(std::uint32_t sides, bool open) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < sides; ++i)
    for (const double z : {0.0, 1.0}) {
      const double angle = 2.0 * M_PI * i / sides;
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
    }
  mesh.vertices.emplace_back(0.0, 0.0, 0.0);
  mesh.vertices.emplace_back(0.0, 0.0, 1.0);
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % sides);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
    mesh.triangles.push_back({2 * sides, b, a});
    if (!open) mesh.triangles.push_back({2 * sides + 1, a + 1, b + 1});
  }
  return mesh;
}

TEST(FillHoles, AFlatCoverIsPutBack) {
  const TriangleMesh whole = cup(60, false), open = cup(60, true);
  EXPECT_EQ(open_edges(whole), 0U);
  EXPECT_EQ(open_edges(open), 60U);
  const FilledMesh filled = fill_holes(open);
  EXPECT_EQ(filled.holes, 1U);
  EXPECT_EQ(open_edges(filled.mesh), 0U);
  EXPECT_NEAR(filled.largest_m, std::sqrt(8.0), 0.01);
  EXPECT_EQ(filled.mesh.triangles.size(), open.triangles.size() + 58U);
  EXPECT_TRUE(check_closed(filled.mesh).ok()) << check_closed(filled.mesh).problem;
  EXPECT_NEAR(volume_properties(filled.mesh).volume, volume_properties(whole).volume, 1e-12);
}

TEST(FillHoles, TwoHolesThatMeetInOneVertexAreTwo) {
  TriangleMesh box = box_mesh(Vec3(0, 0, 0), Vec3(1, 2, 3));
  const double volume = volume_properties(box).volume;
  // Two triangles of different faces with one common vertex.
  for (std::size_t i = 0; i < box.triangles.size(); ++i)
    for (std::size_t k = i + 1; k < box.triangles.size(); ++k) {
      std::size_t common = 0;
      for (const auto a : box.triangles[i])
        for (const auto b : box.triangles[k]) common += a == b ? 1 : 0;
      if (common != 1) continue;
      TriangleMesh open = box;
      open.triangles.erase(open.triangles.begin() + static_cast<std::ptrdiff_t>(k));
      open.triangles.erase(open.triangles.begin() + static_cast<std::ptrdiff_t>(i));
      const FilledMesh filled = fill_holes(open);
      EXPECT_EQ(open_edges(filled.mesh), 0U) << i << ' ' << k;
      EXPECT_TRUE(check_closed(filled.mesh).ok()) << i << ' ' << k;
      EXPECT_NEAR(volume_properties(filled.mesh).volume, volume, 1e-12) << i << ' ' << k;
    }
}

TEST(FillHoles, AVertexBesideAnEdgeLeavesANarrowGapThatIsClosed) {
  // The upper cover knows a vertex 1 um beside the edge of the side.
  TriangleMesh mesh = box_mesh(Vec3(0, 0, 0), Vec3(1, 1, 1));
  const auto at = [&](double x, double y, double z) {
    for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i)
      if ((mesh.vertices[i] - Vec3(x, y, z)).norm() < 1e-12) return i;
    ADD_FAILURE();
    return 0U;
  };
  const std::uint32_t a = at(0, 0, 1), b = at(1, 0, 1);
  mesh.vertices.emplace_back(0.4, 1e-6, 1.0);
  const auto added = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  for (auto& t : mesh.triangles) {
    const bool upper = mesh.vertices[t[0]].z() + mesh.vertices[t[1]].z() + mesh.vertices[t[2]].z() > 2.99;
    for (std::size_t k = 0; k < 3 && upper; ++k)
      if (t[k] == a && t[(k + 1) % 3] == b) {
        const TriangleMesh::Triangle rest{added, b, t[(k + 2) % 3]};
        t[(k + 1) % 3] = added;
        mesh.triangles.push_back(rest);
        break;
      }
  }
  EXPECT_EQ(open_edges(mesh), 3U);
  const FilledMesh filled = fill_holes(mesh);
  EXPECT_EQ(open_edges(filled.mesh), 0U);
  EXPECT_TRUE(check_closed(filled.mesh).ok()) << check_closed(filled.mesh).problem;
  EXPECT_NEAR(volume_properties(filled.mesh).volume, 1.0, 1e-6);
}

}  // namespace
}  // namespace takt::product
