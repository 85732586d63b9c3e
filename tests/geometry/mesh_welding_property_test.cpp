// Vertices that are one within single precision, and bodies that touch along edges: the repair gives closed surfaces of
// the same volume and moves nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "server/geometry/mesh/repair.h"
#include "server/geometry/mesh/welding.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using ::testing::HasSubstr;
using Kind = MeshDiagnosticKind;

/// Cubes of size 1 on a grid: the faces between a cube and none, with common vertices.
TriangleMesh cubes(const std::set<std::array<int, 3>>& filled) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const auto vertex = [&](const std::array<int, 3>& p) {
    const auto [entry, is_new] = numbers.try_emplace(p, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) mesh.vertices.emplace_back(p[0], p[1], p[2]);
    return entry->second;
  };
  for (const auto& cube : filled)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        std::array<int, 3> beyond = cube;
        beyond[axis] += side == 0 ? -1 : 1;
        if (filled.contains(beyond)) continue;
        std::array<std::uint32_t, 4> corner{};
        for (std::size_t k = 0; k < 4; ++k) {
          std::array<int, 3> p = cube;
          p[axis] += side;
          p[(axis + 1) % 3] += k == 1 || k == 2 ? 1 : 0;
          p[(axis + 2) % 3] += k >= 2 ? 1 : 0;
          corner[k] = vertex(p);
        }
        if (side == 0) std::swap(corner[1], corner[3]);
        mesh.triangles.push_back({corner[0], corner[1], corner[2]});
        mesh.triangles.push_back({corner[0], corner[2], corner[3]});
      }
  return mesh;
}

std::size_t count_of(const RepairedMesh& repaired, Kind kind) {
  std::size_t count = 0;
  for (const MeshDiagnostic& finding : repaired.findings)
    if (finding.kind == kind) count += finding.count;
  return count;
}

TEST(MeshWelding, CubesThatTouchAlongAnEdgeAreSeparated) {
  const RepairedMesh two = repair_mesh(cubes({{0, 0, 0}, {1, 1, 0}}));
  EXPECT_EQ(two.problem, "");
  EXPECT_EQ(two.mesh.vertices.size(), 16U);
  EXPECT_EQ(two.mesh.triangles.size(), 24U);
  EXPECT_EQ(count_of(two, Kind::touching_edges), 1U);
  EXPECT_THAT(two.findings.front().sentence, HasSubstr("1 edge belongs to bodies that touch there"));
  EXPECT_DOUBLE_EQ(volume_properties(two.mesh).volume, 2.0);

  // Joined above and below, so that the ends of the edge cannot have copies: it is divided.
  const RepairedMesh ring = repair_mesh(cubes({{0, 0, 0},
                                               {1, 0, 0},
                                               {0, 1, 0},
                                               {1, 1, 0},
                                               {0, 0, 1},
                                               {1, 1, 1},
                                               {0, 0, 2},
                                               {1, 0, 2},
                                               {0, 1, 2},
                                               {1, 1, 2}}));
  EXPECT_EQ(ring.problem, "");
  EXPECT_EQ(count_of(ring, Kind::touching_edges), 1U);
  EXPECT_DOUBLE_EQ(volume_properties(ring.mesh).volume, 10.0);
}

TEST(MeshWelding, RandomCubesHaveTheVolumeOfTheirNumber) {
  std::mt19937_64 g(298);
  std::size_t touching = 0;
  for (int run = 0; run < 300; ++run) {
    SCOPED_TRACE(run);
    std::set<std::array<int, 3>> filled;
    while (filled.size() < 4 + g() % 16)
      filled.insert({static_cast<int>(g() % 3), static_cast<int>(g() % 3), static_cast<int>(g() % 3)});
    TriangleMesh mesh = cubes(filled);
    if (run % 4 == 0)
      for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
    const RepairedMesh repaired = repair_mesh(mesh);
    EXPECT_EQ(repaired.problem, "");
    EXPECT_NEAR(volume_properties(repaired.mesh).volume, static_cast<double>(filled.size()), 1e-9);
    touching += count_of(repaired, Kind::touching_edges);
    for (const MeshDiagnostic& finding : repaired.findings)
      EXPECT_NE(finding.severity, MeshSeverity::refused) << finding.sentence;
  }
  EXPECT_GT(touching, 300U);
}

/// Each triangle with vertices of its own, displaced by up to `noise`.
TriangleMesh apart(const TriangleMesh& mesh, double noise, std::mt19937_64& g) {
  std::uniform_real_distribution<double> of(-noise, noise);
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t v : t) soup.vertices.push_back(mesh.vertices[v] + Vec3(of(g), of(g), of(g)));
    const auto n = static_cast<std::uint32_t>(soup.vertices.size());
    soup.triangles.push_back({n - 3, n - 2, n - 1});
  }
  return soup;
}

TEST(MeshWelding, VerticesThatAreOneInSinglePrecisionAreJoined) {
  std::mt19937_64 g(293);
  for (const TriangleMesh& mesh : {u_shape(), open_box({0.1, 0.08, 0.05}, 0.01), ball(0.02, 3)}) {
    double size = 0.0;
    for (const Vec3& v : mesh.vertices) size = std::max(size, v.cwiseAbs().maxCoeff());
    // Three times the noise along each axis is the largest distance, 3.5 times the one allowed.
    const RepairedMesh joined = repair_mesh(apart(mesh, 0.25 * single_precision_m(size), g));
    EXPECT_EQ(joined.problem, "");
    EXPECT_EQ(joined.mesh.triangles.size(), mesh.triangles.size());
    EXPECT_EQ(count_of(joined, Kind::near_vertices), 3 * mesh.triangles.size() - mesh.vertices.size());
    EXPECT_NEAR(volume_properties(joined.mesh).volume / volume_properties(mesh).volume, 1.0, 1e-4);
    // What is further apart is a hole.
    const RepairedMesh open = repair_mesh(apart(mesh, 100.0 * single_precision_m(size), g));
    EXPECT_THAT(open.problem, HasSubstr("hole"));
  }
}

TEST(MeshWelding, AFaceWithoutAreaBetweenNearVerticesIsRemoved) {
  // A corner of a block is there twice, a millionth of a millimetre apart, with two faces without area in between.
  TriangleMesh mesh = cubes({{0, 0, 0}});
  const auto t = mesh.triangles.front();
  const auto copy = static_cast<std::uint32_t>(mesh.vertices.size());
  const Vec3 beside = mesh.vertices[t[1]] + 1e-13 * (mesh.vertices[t[0]] - mesh.vertices[t[1]]);
  mesh.vertices.push_back(beside);
  mesh.triangles.front() = {t[0], copy, t[2]};
  mesh.triangles.push_back({copy, t[1], t[2]});
  mesh.triangles.push_back({t[0], t[1], copy});
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_EQ(repaired.problem, "");
  EXPECT_NEAR(volume_properties(repaired.mesh).volume, 1.0, 1e-12);
  EXPECT_EQ(count_of(repaired, Kind::zero_area_faces), 2U);
}

std::string obj(const std::string& name, const TriangleMesh& mesh, std::size_t before) {
  std::string text = "o " + name + "\n";
  for (const Vec3& v : mesh.vertices)
    text += "v " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) + "\n";
  for (const auto& t : mesh.triangles)
    text += "f " + std::to_string(t[0] + 1 + before) + " " + std::to_string(t[1] + 1 + before) + " " +
            std::to_string(t[2] + 1 + before) + "\n";
  return text;
}

TEST(MeshWelding, ObjectsThatEncloseNothingArePassedOverBesideOthers) {
  const TemporaryDirectory directory;
  const TriangleMesh sheet{{{1, 0, 0}, {2, 0, 0}, {2, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  const TriangleMesh cube = cubes({{0, 0, 0}});
  directory.write("both.obj", obj("label", sheet, 0) + obj("body", cube, sheet.vertices.size()));
  const RepairedMesh both = import_repaired_solid(directory / "both.obj");
  EXPECT_DOUBLE_EQ(volume_properties(both.mesh).volume, 1.0);
  ASSERT_EQ(both.findings.size(), 1U);
  EXPECT_EQ(both.findings[0].severity, MeshSeverity::repaired);
  EXPECT_THAT(both.findings[0].sentence, HasSubstr("1 object encloses nothing, the first 'label'"));
  directory.write("sheet.obj", obj("label", sheet, 0));
  EXPECT_THAT(import_and_repair(directory / "sheet.obj").problem, HasSubstr("object 'label'"));
}

TEST(MeshWelding, AnObjFileInUtf16IsNamed) {
  const TemporaryDirectory directory;
  std::string wide("\xFF\xFE", 2);
  for (const char c : std::string("v 0 0 0\nf 1 1 1\n")) wide += c, wide += '\0';
  directory.write("wide.obj", wide);
  EXPECT_THAT([&] { import_and_repair(directory / "wide.obj"); },
              ::testing::ThrowsMessage<MeshError>(HasSubstr("as in UTF-16")));
}

}  // namespace
}  // namespace takt::test
