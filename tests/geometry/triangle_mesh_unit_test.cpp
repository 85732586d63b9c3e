// Definition of a solid's boundary; each fault is reported with its place.
#include "server/geometry/mesh/triangle_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <utility>

namespace takt {
namespace {

using ::testing::HasSubstr;

TriangleMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(CheckClosed, AcceptsASolid) {
  EXPECT_EQ(check_closed(tetrahedron()).problem, "");
}

TEST(CheckClosed, AcceptsASolidWithACavity) {
  TriangleMesh mesh = tetrahedron();
  const TriangleMesh inner = tetrahedron();
  for (const Vec3& v : inner.vertices) mesh.vertices.push_back(Vec3(0.1, 0.1, 0.1) + 0.2 * v);
  for (const auto& t : inner.triangles) mesh.triangles.push_back({t[0] + 4, t[2] + 4, t[1] + 4});
  EXPECT_EQ(check_closed(mesh).problem, "");
  EXPECT_NEAR(volume_properties(mesh).volume, (1.0 - 0.008) / 6.0, 1e-15);
}

TEST(CheckClosed, RejectsAnEmptyMesh) {
  EXPECT_THAT(check_closed({}).problem, HasSubstr("no triangles"));
}

TEST(CheckClosed, NamesAVertexThatIsNotFinite) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TriangleMesh mesh = tetrahedron();
    mesh.vertices[2].z() = bad;
    EXPECT_THAT(check_closed(mesh).problem, HasSubstr("vertex 2 (0, 1, "));
    EXPECT_THAT(check_closed(mesh).problem, HasSubstr("not finite"));
  }
}

TEST(CheckClosed, NamesAnIndexOutOfRange) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles[1][2] = 9;
  EXPECT_THAT(check_closed(mesh).problem,
              HasSubstr("triangle 1 refers to vertex 9, but there are only 4 vertices"));
}

TEST(CheckClosed, NamesATriangleWithoutArea) {
  TriangleMesh twice = tetrahedron();
  twice.triangles.push_back({0, 1, 1});
  EXPECT_THAT(check_closed(twice).problem, HasSubstr("triangle 4 has no area"));
  TriangleMesh line = tetrahedron();
  line.vertices.emplace_back(0.1, 0.0, 0.0);
  line.triangles.push_back({0, 1, 4});
  EXPECT_THAT(check_closed(line).problem, HasSubstr("triangle 4 has no area"));
  EXPECT_THAT(check_closed(line).problem, HasSubstr("vertex 4 (0.1, 0, 0)"));
}

TEST(CheckClosed, NamesTheEdgeOfAHole) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.pop_back();
  EXPECT_THAT(check_closed(mesh).problem,
              HasSubstr("the edge from vertex 1 (1, 0, 0) to vertex 2 (0, 1, 0) belongs to triangle 0 only"));
}

TEST(CheckClosed, NamesAnEdgeOfThreeTriangles) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.emplace_back(1.0, 1.0, -1.0);
  mesh.triangles.push_back({0, 1, 4});
  EXPECT_THAT(check_closed(mesh).problem,
              HasSubstr("vertex 0 (0, 0, 0) to vertex 1 (1, 0, 0) belongs to 3 triangles (0, 1, 4)"));
}

TEST(CheckClosed, NamesAFlippedTriangle) {
  TriangleMesh mesh = tetrahedron();
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  EXPECT_THAT(check_closed(mesh).problem, HasSubstr("same direction by triangles 0 and 3"));
}

TEST(CheckClosed, RejectsASolidInsideOut) {
  TriangleMesh mesh = tetrahedron();
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  EXPECT_THAT(check_closed(mesh).problem, HasSubstr("the faces point inwards"));
}

TEST(CheckClosed, RejectsASurfaceThatEnclosesNothing) {
  const TriangleMesh sheet{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  EXPECT_THAT(check_closed(sheet).problem, HasSubstr("encloses nothing"));
}

TEST(CheckClosed, AcceptsEverySizeThatCanBeComputed) {
  for (const double scale : {1e-9, 1e-3, 1e3, 1e12}) {
    TriangleMesh mesh = tetrahedron();
    for (Vec3& v : mesh.vertices) v *= scale;
    EXPECT_EQ(check_closed(mesh).problem, "") << scale;
  }
  TriangleMesh mesh = tetrahedron();
  for (Vec3& v : mesh.vertices) v *= 1e150;
  EXPECT_FALSE(check_closed(mesh).ok());
}

}  // namespace
}  // namespace takt
