// Defects that would falsify contact forces are reported with figure, place and remedy, and only where they
// exist; the remedies help.
#include "server/geometry/mesh/quality.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "server/geometry/mesh/refinement.h"
#include "tests/support/hollow_bodies.h"

namespace takt::test {
namespace {

using ::testing::HasSubstr;
using Kind = MeshDiagnosticKind;

TriangleMesh committed(const std::string& name) {
  return import_solid(std::string(TAKT_CONFIG_DIR) + "/meshes/" + name + ".obj");
}

MeshQualityOptions options_of(const std::string& component) {
  MeshQualityOptions options;
  options.component = component;
  return options;
}

const MeshDiagnostic* find(const std::vector<MeshDiagnostic>& findings, Kind kind) {
  const auto at =
      std::find_if(findings.begin(), findings.end(), [&](const MeshDiagnostic& f) { return f.kind == kind; });
  return at == findings.end() ? nullptr : &*at;
}

/// The element edge that a remedy names.
double edge_of(const MeshDiagnostic& finding) {
  const std::size_t at = finding.remedy.find("element_edge_m to ");
  EXPECT_NE(at, std::string::npos) << finding.remedy;
  return std::stod(finding.remedy.substr(at + 18));
}

TEST(MeshCare, ABallHasNoDiagnostics) {
  EXPECT_TRUE(check_mesh_quality(committed("contact/sphere"), {}).empty());
}

TEST(MeshCare, SharpEdgesAreCountedAndMeasured) {
  const auto findings = check_mesh_quality(block_mesh(), {});
  const MeshDiagnostic* sharp = find(findings, Kind::sharp_edges);
  ASSERT_NE(sharp, nullptr);
  EXPECT_EQ(sharp->count, 12U);
  EXPECT_NEAR(sharp->figure, 90.0, 1e-9);
  EXPECT_EQ(sharp->severity, MeshSeverity::info);
  EXPECT_THAT(sharp->sentence, HasSubstr("12 edges are sharp, 960 mm in all"));
  EXPECT_THAT(sharp->remedy, HasSubstr("chamfer"));
  // Chamfered below: the four edges there are gone, 8 of 40 mm (less 1 mm each) remain.
  const auto block = check_mesh_quality(committed("contact/block"), {});
  ASSERT_NE(find(block, Kind::sharp_edges), nullptr);
  EXPECT_THAT(find(block, Kind::sharp_edges)->sentence, HasSubstr("316 mm in all"));
  // Those of a pocket are concave: a U has 18 convex edges (400 mm around each end, 6 across) and two
  // concave.
  const auto u = check_mesh_quality(u_shape(), {});
  ASSERT_NE(find(u, Kind::sharp_edges), nullptr);
  EXPECT_THAT(find(u, Kind::sharp_edges)->sentence, HasSubstr("1260 mm in all"));
}

TEST(MeshCare, AKnifeIsAWarning) {
  const TriangleMesh knife = prism({{0.0, 0.0}, {0.02, -0.002}, {0.02, 0.002}}, {{0, 1, 2}}, 0.0, 0.05);
  const auto findings = check_mesh_quality(knife, {});
  ASSERT_NE(find(findings, Kind::sharp_edges), nullptr);
  EXPECT_EQ(find(findings, Kind::sharp_edges)->severity, MeshSeverity::warning);
  EXPECT_NEAR(find(findings, Kind::sharp_edges)->figure, 180.0 - 2.0 * std::atan(0.1) * 180.0 / M_PI, 1e-9);
  EXPECT_LT((find(findings, Kind::sharp_edges)->place_B - Vec3(0.0, 0.0, 0.025)).norm(), 1e-12);
}

TEST(MeshCare, CoarseFacesAreReportedAndTheRemedyHelps) {
  const auto findings = check_mesh_quality(block_mesh(), options_of("Box"));
  const MeshDiagnostic* coarse = find(findings, Kind::coarse);
  ASSERT_NE(coarse, nullptr);
  EXPECT_EQ(coarse->severity, MeshSeverity::warning);
  EXPECT_EQ(coarse->count, 6U);
  EXPECT_NEAR(coarse->figure, 1.0, 1e-12);  // two triangles
  EXPECT_THAT(coarse->remedy, HasSubstr("set contact.components.Box.element_edge_m to "));
  const double edge = edge_of(*coarse);
  EXPECT_EQ(find(check_mesh_quality(refine_to_edge(block_mesh(), edge), {}), Kind::coarse), nullptr);
  // The same without doing it, as it will be done for contact.
  MeshQualityOptions divided;
  divided.element_edge_m = edge;
  EXPECT_EQ(find(check_mesh_quality(block_mesh(), divided), Kind::coarse), nullptr);
  divided.element_edge_m = 3.0 * edge;
  EXPECT_NE(find(check_mesh_quality(block_mesh(), divided), Kind::coarse), nullptr);
  EXPECT_NE(find(check_mesh_quality(refine_to_edge(block_mesh(), 3.0 * edge), {}), Kind::coarse), nullptr);
  // A body that is only a Target may be coarse.
  MeshQualityOptions target;
  target.carries_elements = false;
  EXPECT_EQ(find(check_mesh_quality(block_mesh(), target), Kind::coarse), nullptr);
}

TEST(MeshCare, MeshesMadeForContactAreFineEnough) {
  for (const char* name :
       {"B", "C", "O", "P", "gripper_jaw", "contact/block", "contact/slab", "contact/sphere",
        "contact/peg_10um", "contact/press_peg", "contact/bolt", "contact/ring"}) {
    for (const MeshDiagnostic& finding : check_mesh_quality(committed(name), {}))
      EXPECT_LE(finding.severity, MeshSeverity::info) << name << ": " << finding.sentence;
  }
}

TEST(MeshCare, NeedlesAreReported) {
  const TriangleMesh rod = box_mesh({0.3, 0.004, 0.004});
  const auto findings = check_mesh_quality(rod, options_of("Rod"));
  const MeshDiagnostic* needles = find(findings, Kind::needles);
  ASSERT_NE(needles, nullptr);
  EXPECT_EQ(needles->count, 8U);
  EXPECT_NEAR(needles->figure, (0.3 * 0.3 + 0.004 * 0.004) / (0.3 * 0.004), 1e-9);
  EXPECT_THAT(needles->sentence, HasSubstr("8 triangles are needles"));
  EXPECT_THAT(needles->remedy, HasSubstr("mesh it again"));
  // Divided into similar pieces they stay needles, as the remedy says; remeshed they vanish.
  EXPECT_NE(find(check_mesh_quality(refine_to_edge(rod, 0.05), {}), Kind::needles), nullptr);
  EXPECT_EQ(find(check_mesh_quality(box_mesh({0.1, 0.004, 0.004}), {}), Kind::needles), nullptr);
  EXPECT_EQ(find(check_mesh_quality(block_mesh(), {}), Kind::needles), nullptr);
}

TEST(MeshCare, ABodyFarFromItsOriginIsReported) {
  for (const auto& [away, reported] : {std::pair{1.0, false}, {20.0, true}}) {
    const auto findings = check_mesh_quality(box_mesh({0.1, 0.08, 0.06}, {0.0, away, 0.0}), {});
    EXPECT_EQ(find(findings, Kind::far_from_origin) != nullptr, reported);
  }
  const auto findings = check_mesh_quality(box_mesh({0.1, 0.08, 0.06}, {0.0, 20.0, -0.03}), {});
  const MeshDiagnostic* far = find(findings, Kind::far_from_origin);
  ASSERT_NE(far, nullptr);
  EXPECT_NEAR(far->figure, 20.04 / 16777216.0, 1e-12);
  EXPECT_THAT(far->sentence, HasSubstr("20 m from the origin"));
  // A large body may reach far.
  EXPECT_EQ(find(check_mesh_quality(box_mesh({20.0, 4.0, 0.1}), {}), Kind::far_from_origin), nullptr);
}

}  // namespace
}  // namespace takt::test
