// Each fault of a mesh: found where it is and not where it is not, repaired or refused, with number, place
// and remedy.
#include "server/geometry/mesh/repair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/mesh/edges.h"
#include "server/geometry/mesh/import.h"
#include "server/geometry/mesh/refinement.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using ::testing::HasSubstr;
using Kind = MeshDiagnosticKind;
using Severity = MeshSeverity;

void add(TriangleMesh& mesh, const TriangleMesh& other, bool inside_out = false) {
  const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& t : other.triangles) {
    mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    if (inside_out) std::swap(mesh.triangles.back()[1], mesh.triangles.back()[2]);
  }
}

void turn_all(TriangleMesh& mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

/// The only finding.
MeshDiagnostic only(const RepairedMesh& repaired) {
  EXPECT_EQ(repaired.findings.size(), 1U);
  for (const MeshDiagnostic& finding : repaired.findings)
    EXPECT_THAT(finding.remedy, HasSubstr(std::string(remedy_of(finding.kind)))) << finding.sentence;
  return repaired.findings.empty() ? MeshDiagnostic{} : repaired.findings.front();
}

void expect_box(const RepairedMesh& repaired) {
  EXPECT_EQ(repaired.problem, "");
  EXPECT_EQ(repaired.mesh.triangles.size(), 12U);
  EXPECT_NEAR(volume_properties(repaired.mesh).volume, 4.8e-4, 1e-15);
}

/// The first face divided at points of one of its edges; the neighbour beyond that edge is not.
TriangleMesh with_vertices_on_an_edge(int count, double beside_m) {
  TriangleMesh mesh = block_mesh();
  const auto [a, b, c] = mesh.triangles[0];
  const Vec3 from = mesh.vertices[a], to = mesh.vertices[b];
  const Vec3 across = (mesh.vertices[c] - from).cross(to - from).normalized();
  std::uint32_t last = a;
  for (int i = 1; i <= count; ++i) {
    mesh.vertices.push_back(from + i / (count + 1.0) * (to - from) + beside_m * across);
    const auto next = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    mesh.triangles.push_back({last, next, c});
    last = next;
  }
  mesh.triangles[0] = {last, b, c};
  return mesh;
}

TEST(MeshRepair, EdgesAreDividedAtVerticesThatLieOnThem) {
  for (const int count : {1, 3}) {
    const TriangleMesh mesh = with_vertices_on_an_edge(count, 0.0);
    EXPECT_NE(check_closed(mesh).problem, "");
    const RepairedMesh repaired = repair_mesh(mesh);
    EXPECT_EQ(repaired.problem, "");
    EXPECT_EQ(repaired.mesh.vertices, mesh.vertices);
    EXPECT_EQ(repaired.mesh.triangles.size(), 12U + 2U * static_cast<std::size_t>(count));
    EXPECT_NEAR(volume_properties(repaired.mesh).volume, 4.8e-4, 1e-15);
    const MeshDiagnostic finding = only(repaired);
    EXPECT_EQ(finding.kind, Kind::split_edges);
    EXPECT_EQ(finding.severity, Severity::repaired);
    EXPECT_EQ(finding.count, static_cast<std::size_t>(count));
  }
}

TEST(MeshRepair, AVertexBesideAnEdgeLeavesAHole) {
  const RepairedMesh repaired = repair_mesh(with_vertices_on_an_edge(1, 1e-5));
  EXPECT_NE(repaired.problem, "");
  EXPECT_EQ(only(repaired).kind, Kind::open_edges);
}

TEST(MeshRepair, ASoundMeshIsUnchanged) {
  for (const TriangleMesh& mesh : {block_mesh(), u_shape()}) {
    const RepairedMesh repaired = repair_mesh(mesh);
    EXPECT_TRUE(repaired.findings.empty());
    EXPECT_EQ(repaired.problem, "");
    EXPECT_EQ(repaired.mesh.triangles, mesh.triangles);
  }
}

TEST(MeshRepair, DuplicateFacesAreRemoved) {
  TriangleMesh mesh = block_mesh();
  const auto t = mesh.triangles[3], u = mesh.triangles[7];
  mesh.triangles.push_back({t[1], t[2], t[0]});
  mesh.triangles.push_back({u[0], u[2], u[1]});  // the other way round
  mesh.triangles.push_back(u);
  const RepairedMesh repaired = repair_mesh(mesh);
  expect_box(repaired);
  const MeshDiagnostic finding = only(repaired);
  EXPECT_EQ(finding.kind, Kind::duplicate_faces);
  EXPECT_EQ(finding.severity, Severity::repaired);
  EXPECT_EQ(finding.count, 3U);
  EXPECT_THAT(finding.sentence, HasSubstr("3 faces are there more than once, the first at ("));
}

TEST(MeshRepair, AWallInsideIsRemoved) {
  // Two pyramids over one square: between them a double wall.
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}, {0.5, 0.5, -1}}, {}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    mesh.triangles.push_back({i, (i + 1) % 4, 4});
    mesh.triangles.push_back({(i + 1) % 4, i, 5});
  }
  const std::size_t sound = mesh.triangles.size();
  for (const auto& t : {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 3, 2}, {0, 1, 2}, {0, 2, 3}})
    mesh.triangles.push_back(t);
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_EQ(repaired.problem, "");
  EXPECT_EQ(only(repaired).count, 4U);
  EXPECT_EQ(repaired.mesh.triangles.size(), sound);
  EXPECT_NEAR(volume_properties(repaired.mesh).volume, 2.0 / 3.0, 1e-15);
}

TEST(MeshRepair, FacesWithoutAreaAreRemoved) {
  TriangleMesh twice = block_mesh();
  twice.triangles.push_back({2, 2, 5});
  const RepairedMesh repaired = repair_mesh(twice);
  expect_box(repaired);
  EXPECT_EQ(only(repaired).kind, Kind::zero_area_faces);
  EXPECT_EQ(only(repaired).count, 1U);

  // A vertex in the middle of an edge that only one of its two triangles has, and the flat face between.
  TriangleMesh line = block_mesh();
  const auto t = line.triangles[0];
  const auto middle = static_cast<std::uint32_t>(line.vertices.size());
  line.vertices.emplace_back(0.5 * (line.vertices[t[0]] + line.vertices[t[1]]));
  line.triangles[0] = {t[0], middle, t[2]};
  line.triangles.push_back({middle, t[1], t[2]});
  line.triangles.push_back({t[0], t[1], middle});
  ASSERT_THAT(check_closed(line).problem, HasSubstr("has no area"));
  const RepairedMesh turned = repair_mesh(line);
  EXPECT_EQ(turned.problem, "");
  EXPECT_EQ(only(turned).kind, Kind::zero_area_faces);
  EXPECT_EQ(only(turned).count, 1U);
  EXPECT_LT((only(turned).place_B - line.vertices[middle]).norm(), 1e-12);
  EXPECT_EQ(turned.mesh.triangles.size(), 14U);
  EXPECT_NEAR(volume_properties(turned.mesh).volume, 4.8e-4, 1e-15);
}

TEST(MeshRepair, FlatFacesBetweenVerticesInOnePlaceGoWithThem) {
  TriangleMesh mesh = block_mesh();
  const auto t = mesh.triangles[0];
  const auto copy = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(mesh.vertices[t[1]]);
  mesh.triangles[0] = {t[0], copy, t[2]};
  mesh.triangles.push_back({t[0], t[1], copy});
  mesh.triangles.push_back({t[1], t[2], copy});
  const RepairedMesh repaired = repair_mesh(mesh);
  expect_box(repaired);
  ASSERT_EQ(repaired.findings.size(), 2U);
  EXPECT_EQ(repaired.findings[0].kind, Kind::zero_area_faces);
  EXPECT_EQ(repaired.findings[0].count, 2U);
  EXPECT_EQ(repaired.findings[1].kind, Kind::near_vertices);
  EXPECT_EQ(repaired.findings[1].count, 1U);
}

TEST(MeshRepair, AFlatFaceThatCannotGoIsRefused) {
  // It has no neighbour to be turned into.
  TriangleMesh mesh = block_mesh();
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const double x : {1.0, 2.0, 3.0}) mesh.vertices.emplace_back(x, 0.0, 0.0);
  mesh.triangles.push_back({first, first + 1, first + 2});
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_NE(repaired.problem, "");
  ASSERT_FALSE(repaired.findings.empty());
  EXPECT_EQ(repaired.findings[0].kind, Kind::zero_area_faces);
  EXPECT_EQ(repaired.findings[0].severity, Severity::refused);
  EXPECT_EQ(repaired.findings[0].count, 1U);
  EXPECT_THAT(repaired.findings[0].remedy, HasSubstr("Mesh > Merge > By Distance"));
}

TEST(MeshRepair, OpenEdgesAreRefusedWithNumberLengthAndPlace) {
  TriangleMesh mesh = block_mesh();
  mesh.triangles.erase(mesh.triangles.begin());  // of the bottom: 100, 80 and their diagonal
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_THAT(repaired.problem, HasSubstr("the surface has a hole there"));
  const MeshDiagnostic finding = only(repaired);
  EXPECT_EQ(finding.kind, Kind::open_edges);
  EXPECT_EQ(finding.severity, Severity::refused);
  EXPECT_EQ(finding.count, 3U);
  EXPECT_NEAR(finding.figure, 0.18 + std::hypot(0.1, 0.08), 1e-12);
  EXPECT_NEAR(finding.place_B.z(), 0.0, 1e-15);
  EXPECT_THAT(finding.sentence, HasSubstr("308.1 mm in all"));
}

TEST(MeshRepair, EdgesOfMoreThanTwoFacesAreRefused) {
  TriangleMesh mesh = block_mesh();  // and a fin on its first edge
  mesh.vertices.emplace_back(0.0, 0.0, 0.2);
  mesh.triangles.push_back({0, 1, static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_NE(repaired.problem, "");
  ASSERT_EQ(repaired.findings.size(), 2U);
  EXPECT_EQ(repaired.findings[0].kind, Kind::open_edges);
  EXPECT_EQ(repaired.findings[0].count, 2U);
  EXPECT_EQ(repaired.findings[1].kind, Kind::crowded_edges);
  EXPECT_EQ(repaired.findings[1].count, 1U);
  EXPECT_EQ(repaired.findings[1].figure, 3.0);
}

TEST(MeshRepair, FacesAgainstTheirNeighboursAreTurned) {
  TriangleMesh mesh = block_mesh();
  for (const std::size_t i : {2U, 3U, 9U}) std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
  const RepairedMesh repaired = repair_mesh(mesh);
  expect_box(repaired);
  EXPECT_EQ(only(repaired).kind, Kind::mixed_orientation);
  EXPECT_EQ(only(repaired).severity, Severity::repaired);
  EXPECT_EQ(only(repaired).count, 3U);
}

TEST(MeshRepair, AShellInsideOutIsTurnedWithItsCavities) {
  TriangleMesh mesh = block_mesh();
  add(mesh, box_mesh({0.02, 0.02, 0.02}, {0.0, 0.0, 0.01}), true);
  const double volume = volume_properties(mesh).volume;
  EXPECT_EQ(only(repair_mesh(mesh)).kind, Kind::cavities);
  turn_all(mesh);
  add(mesh, box_mesh({0.01, 0.01, 0.01}, {0.3, 0.0, 0.0}));  // another body that is sound
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_EQ(repaired.problem, "");
  EXPECT_NEAR(volume_properties(repaired.mesh).volume, volume + 1e-6, 1e-15);
  ASSERT_EQ(repaired.findings.size(), 2U);
  EXPECT_EQ(repaired.findings[0].kind, Kind::inside_out);
  EXPECT_EQ(repaired.findings[0].count, 1U);
  EXPECT_NEAR(repaired.findings[0].figure, 4.8e-4, 1e-12);
  EXPECT_THAT(repaired.findings[0].sentence,
              HasSubstr("1 closed shell is inside out, the largest of 480 cm^3"));
  EXPECT_EQ(repaired.findings[1].kind, Kind::cavities);
  EXPECT_EQ(repaired.findings[1].severity, Severity::info);
  EXPECT_NEAR(repaired.findings[1].figure, 8e-6, 1e-15);
}

TEST(MeshRepair, ASolidInsideAnotherIsReportedAndOneInACavityIsNot) {
  TriangleMesh mesh = block_mesh();
  add(mesh, box_mesh({0.04, 0.04, 0.04}, {0.0, 0.0, 0.01}));
  const RepairedMesh twice = repair_mesh(mesh);
  EXPECT_EQ(twice.problem, "");
  EXPECT_EQ(only(twice).kind, Kind::nested_solids);
  EXPECT_EQ(only(twice).severity, Severity::warning);
  EXPECT_NEAR(only(twice).figure, 6.4e-5, 1e-15);

  TriangleMesh rattle = block_mesh();
  add(rattle, box_mesh({0.04, 0.04, 0.04}, {0.0, 0.0, 0.01}), true);
  add(rattle, box_mesh({0.02, 0.02, 0.02}, {0.0, 0.0, 0.02}));
  EXPECT_EQ(only(repair_mesh(rattle)).kind, Kind::cavities);
  EXPECT_EQ(only(repair_mesh(rattle)).count, 1U);
}

TEST(MeshRepair, SurfacesThatEncloseNothingAreRemovedOrRefused) {
  // A sheet with two sides that are cut differently.
  const TriangleMesh sheet{{{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}},
                           {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
  EXPECT_EQ(only(repair_mesh(sheet)).kind, Kind::encloses_nothing);
  EXPECT_EQ(only(repair_mesh(sheet)).severity, Severity::refused);
  EXPECT_THAT(repair_mesh(sheet).problem, HasSubstr("encloses nothing"));
  TriangleMesh mesh = block_mesh();
  add(mesh, sheet);
  const RepairedMesh repaired = repair_mesh(mesh);
  expect_box(repaired);
  EXPECT_EQ(only(repaired).kind, Kind::encloses_nothing);
  EXPECT_EQ(only(repaired).severity, Severity::repaired);
  // Cut alike, its sides are one face twice.
  const TriangleMesh flap{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  EXPECT_NE(repair_mesh(flap).problem, "");
  EXPECT_EQ(repair_mesh(flap).findings.back().severity, Severity::refused);
}

TEST(MeshRepair, ASurfaceWithOneSideIsRefused) {
  // A torus of 8 x 8 quadrilaterals, glued with a twist: a Klein bottle (it passes through itself).
  TriangleMesh mesh;
  constexpr std::uint32_t n = 8;
  std::mt19937_64 g(3);
  for (std::uint32_t i = 0; i < n * n; ++i)
    mesh.vertices.emplace_back(std::uniform_real_distribution<double>(0, 1)(g), 0.1 * i, 0.01 * (i % 7));
  const auto at = [](std::uint32_t i, std::uint32_t k) { return i == n ? (n - k % n) % n : i * n + k % n; };
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t k = 0; k < n; ++k) {
      mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_NE(repaired.problem, "");
  EXPECT_EQ(only(repaired).kind, Kind::not_orientable);
}

TEST(MeshRepair, InvalidMeshesAreRefused) {
  EXPECT_EQ(only(repair_mesh({})).kind, Kind::bad_vertex);
  TriangleMesh missing = block_mesh();
  missing.triangles[1][0] = 99;
  EXPECT_THAT(only(repair_mesh(missing)).sentence, HasSubstr("triangle 1 refers to vertex 99"));
  TriangleMesh infinite = block_mesh();
  infinite.vertices[2].x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(only(repair_mesh(infinite)).severity, Severity::refused);
}

TEST(MeshRepair, RandomDamageIsRepaired) {
  std::mt19937_64 g(54);
  const auto integer = [&](std::size_t n) { return static_cast<std::size_t>(g() % n); };
  for (int run = 0; run < 100; ++run) {
    SCOPED_TRACE(run);
    TriangleMesh sound = refine_to_edge(run % 2 == 0 ? u_shape() : open_box({0.1, 0.08, 0.05}, 0.01), 0.03);
    const double volume = volume_properties(sound).volume;
    TriangleMesh mesh = sound;
    // Edges halved for one of their triangles only, with a flat face in between.
    for (int i = 0; i < 4; ++i) {
      const std::size_t k = integer(sound.triangles.size());
      if (mesh.triangles[k] != sound.triangles[k]) continue;
      const auto t = mesh.triangles[k];
      const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
      const Vec3 place = 0.5 * (mesh.vertices[t[0]] + mesh.vertices[t[1]]);
      if (std::find(mesh.vertices.begin(), mesh.vertices.end(), place) != mesh.vertices.end()) continue;
      mesh.vertices.push_back(place);
      mesh.triangles[k] = {t[0], middle, t[2]};
      mesh.triangles.push_back({middle, t[1], t[2]});
      mesh.triangles.push_back({t[0], t[1], middle});
    }
    const std::size_t halved = mesh.triangles.size();
    for (int i = 0; i < 5; ++i) {
      const std::size_t k = integer(sound.triangles.size());
      if (has_area(mesh, mesh.triangles[k])) mesh.triangles.push_back(mesh.triangles[k]);
    }
    // A few turned. (Not those beside a flat face, whose orientation is undefined.)
    if (run % 3 == 0 && halved == sound.triangles.size())
      for (int i = 0; i < 10; ++i) {
        auto& t = mesh.triangles[integer(sound.triangles.size())];
        std::swap(t[0], t[1]);
      }
    if (run % 5 == 0) turn_all(mesh);
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), g);
    const RepairedMesh repaired = repair_mesh(mesh);
    EXPECT_EQ(repaired.problem, "");
    EXPECT_EQ(repaired.mesh.triangles.size(), halved);
    EXPECT_NEAR(volume_properties(repaired.mesh).volume / volume, 1.0, 1e-12);
    for (const MeshDiagnostic& finding : repaired.findings) EXPECT_EQ(finding.severity, Severity::repaired);
  }
}

TEST(ImportAndRepair, ObjectsAreRepairedOneByOneOrAsOneSurface) {
  const TemporaryDirectory directory;
  TriangleMesh inside_out = block_mesh();
  turn_all(inside_out);
  directory.write("two.obj",
                  obj_text("a", inside_out) + obj_text("b", box_mesh({0.1, 0.1, 0.1}, {1, 0, 0}), 8));
  const RepairedMesh two = import_repaired_solid(directory / "two.obj");
  EXPECT_NEAR(volume_properties(two.mesh).volume, 4.8e-4 + 1e-3, 1e-12);
  EXPECT_EQ(only(two).kind, Kind::inside_out);

  // One surface in two groups, one of them turned.
  TriangleMesh low = block_mesh(), high = block_mesh();
  low.triangles.resize(6);
  high.triangles.erase(high.triangles.begin(), high.triangles.begin() + 6);
  turn_all(high);
  directory.write("groups.obj", obj_text("low", low) + obj_text("high", high, 8));
  const RepairedMesh groups = import_repaired_solid(directory / "groups.obj");
  EXPECT_NEAR(volume_properties(groups.mesh).volume, 4.8e-4, 1e-12);

  TriangleMesh open = block_mesh();
  open.triangles.pop_back();
  directory.write("open.obj", obj_text("o", open));
  try {
    import_repaired_solid(directory / "open.obj");
    FAIL();
  } catch (const MeshError& error) {
    EXPECT_THAT(error.what(), HasSubstr("open.obj: object 'o': the edge from vertex"));
    EXPECT_THAT(error.what(), HasSubstr("A solid is needed"));
  }
  EXPECT_EQ(only(import_and_repair(directory / "open.obj")).kind, Kind::open_edges);
}

}  // namespace
}  // namespace takt::test
