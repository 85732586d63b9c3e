// Reports about meshes: by `takt-run check-mesh`, and by notes when a scenario is loaded.
#include "server/headless/mesh_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <utility>

#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"
#include "server/scenario/scenario_writer.h"
#include "server/simulation/model/model_hash.h"
#include "tests/support/glb_file.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::ThrowsMessage;

class MeshCheckTest : public ::testing::Test {
 protected:
  void SetUp() override {
    TriangleMesh box = box_mesh({0.1, 0.08, 0.06});
    directory_.write("box.obj", obj_text("box", box));
    TriangleMesh open = box;
    open.triangles.pop_back();
    directory_.write("open.obj", obj_text("open", open));
    for (auto& t : box.triangles) std::swap(t[1], t[2]);
    directory_.write("inside_out.obj", obj_text("box", box));
  }

  std::string table(const std::string& file, bool usable, const MeshCheckOptions& options = {}) {
    std::ostringstream out;
    EXPECT_EQ(print_mesh_check(out, directory_ / file, options), usable) << file;
    return out.str();
  }

  Scenario scenario(const std::string& part_mesh) {
    directory_.write("s.yaml", "takt_scenario: 1\nname: test\nparts:\n  A: {mesh: " + part_mesh +
                                   ", mass_kg: 1, hierarchy: 2}\ngrounds:\n  G: {mesh: box.obj}\n");
    return read_scenario(directory_ / "s.yaml");
  }

  TemporaryDirectory directory_;
};

TEST_F(MeshCheckTest, AUsableMeshHasATableWithoutFaults) {
  const std::string text = table("box.obj", true);
  EXPECT_THAT(text, AllOf(HasSubstr("8 vertices, 12 triangles, 100 x 80 x 60 mm, longest edge 128.1 mm"),
                          HasSubstr("volume 480 cm^3, 1 shell\n"), HasSubstr("warning   coarse for contact"),
                          HasSubstr("Remedy: set contact.components.NAME.element_edge_m to 0.012"),
                          HasSubstr("info      sharp edges"), HasSubstr("\nUsable.\n")));
  EXPECT_LT(text.find("coarse for contact"), text.find("sharp edges"));
  // With the remedy, and in millimetres.
  EXPECT_THAT(table("box.obj", true, {.element_edge_m = 0.012}), Not(HasSubstr("coarse")));
  EXPECT_THAT(table("box.obj", true, {.scale = 0.001}), HasSubstr("0.1 x 0.08 x 0.06 mm"));
}

TEST_F(MeshCheckTest, FaultyMeshesHaveATableOfTheirFaults) {
  EXPECT_THAT(
      table("inside_out.obj", true),
      AllOf(HasSubstr("repaired  inside out"), HasSubstr("1 closed shell is inside out"),
            HasSubstr("turned; in Blender: Mesh > Normals > Recalculate Outside"), HasSubstr("\nUsable.\n")));
  EXPECT_THAT(table("open.obj", false),
              AllOf(HasSubstr("refused   open edges"), HasSubstr("3 edges belong to one face only"),
                    HasSubstr("Remedy: export a solid, not a surface (in FreeCAD: Part > Convert to Solid)"),
                    HasSubstr("\nUnusable: object 'open': the edge"), Not(HasSubstr("coarse"))));
  EXPECT_THROW(table("missing.obj", false), MeshError);
}

TEST_F(MeshCheckTest, NodesOfAGlbFileAreListed) {
  directory_.write("cell.glb", glb_cell());
  const std::string text = table("cell.glb", false);
  EXPECT_THAT(text,
              AllOf(HasSubstr("6 nodes; one of them is the mesh cell.glb#NAME"),
                    HasSubstr("Cell/Frame/Housing  4 vertices, 4 triangles, 2000 x 2000 x 2000 mm, longest "
                              "edge 2828 mm, at (1, 2.5, 3) m, closed\n"),
                    HasSubstr("Cell/Frame          with the nodes below it: 8 vertices"),
                    HasSubstr("Cell/Plate          with"), HasSubstr("not closed: object 'Cell/Plate'")));
  EXPECT_THAT(table("cell.glb#Housing", true), AllOf(HasSubstr("4 triangles"), Not(HasSubstr("nodes"))));
}

TEST_F(MeshCheckTest, PartsAreNodesOfOneGlbFile) {
  directory_.write("cell.glb", glb_cell());
  directory_.write(
      "s.yaml",
      "takt_scenario: 1\nname: test\nparts:\n"
      "  H: {mesh: cell.glb#Housing, at_node: true, mass_kg: 1, hierarchy: 2, pose: {position_m: [0, "
      "0, 10], rpy_deg: [0, 0, 90]}}\n"
      "  B: {mesh: 'cell.glb#Plate/Bolt', mass_kg: 1, hierarchy: 1, pose: {position_m: [9, 0, 0]}}\n"
      "grounds:\n  G: {mesh: cell.glb#Frame/Bolt, at_node: true}\n");
  const Scenario scenario = read_scenario(directory_ / "s.yaml");
  const auto cell = build_cell(scenario);
  // The file is turned by 90 degrees about z and lifted: (1, 2.5, 3) becomes (-2.5, 1, 13).
  EXPECT_LT((cell->parts[0].X_WB_initial.p - Vec3(-2.5, 1.0, 13.0)).norm(), 1e-12);
  EXPECT_LT((cell->parts[0].X_WB_initial.R.col(0) + Vec3::UnitX()).norm(), 1e-12);
  EXPECT_LT((cell->parts[0].p_BBcm - Vec3(0.5, 0.5, 0.5)).norm(), 1e-12);
  EXPECT_EQ(cell->parts[1].X_WB_initial.p, Vec3(9.0, 0.0, 0.0));
  EXPECT_LT((cell->grounds[0].X_WB.p - Vec3(0.75, 2.0, 3.0)).norm(), 1e-12);
  EXPECT_EQ(cell->description.components[1].mesh_uri, "cell.glb#Plate/Bolt");
  // Written and read back.
  directory_.write("again.yaml", write_scenario(scenario, directory_.path()));
  EXPECT_EQ(model_hash(*load_cell(directory_ / "again.yaml")), model_hash(*cell));
  ScenarioOptions options;
  options.overrides = {"parts.B.at_node=true"};
  EXPECT_NE(model_hash(*load_cell(directory_ / "s.yaml", options)), model_hash(*cell));
  options.overrides = {"parts.B.mesh=box.obj", "parts.B.at_node=true"};
  EXPECT_THAT([&] { load_cell(directory_ / "s.yaml", options); },
              ThrowsMessage<ScenarioError>(
                  AllOf(HasSubstr("parts.B.at_node"), HasSubstr("allowed: only with a mesh FILE.glb#NODE"))));
}

TEST_F(MeshCheckTest, ScenariosReportRepairedMeshes) {
  EXPECT_THAT(build_cell(scenario("box.obj"))->import_notes, IsEmpty());
  const auto cell = build_cell(scenario("inside_out.obj"));
  ASSERT_EQ(cell->import_notes.size(), 1U);
  EXPECT_EQ(cell->import_notes[0].component, "A");
  EXPECT_THAT(cell->import_notes[0].sentence,
              AllOf(HasSubstr("A: in inside_out.obj 1 closed shell is inside out"), HasSubstr("turned")));
  EXPECT_NEAR(cell->parts[0].p_BBcm.z(), 0.03, 1e-12);
  EXPECT_GT(cell->parts[0].I_BBcm_B(0, 0), 0.0);
  EXPECT_THAT([&] { build_cell(scenario("open.obj")); },
              ThrowsMessage<MeshError>(AllOf(HasSubstr("`takt-run check-mesh "),
                                             HasSubstr("open.obj` lists the faults and their remedies"))));
}

TEST_F(MeshCheckTest, ScenariosWithSurfaceContactReportUnsuitableMeshes) {
  Scenario with_contact = scenario("box.obj");
  with_contact.processes.front().level_of_detail = 3;
  const auto cell = build_cell(with_contact);
  // Of the Part; a ground is only pressed into.
  ASSERT_EQ(cell->import_notes.size(), 1U);
  EXPECT_EQ(cell->import_notes[0].component, "A");
  EXPECT_THAT(cell->import_notes[0].sentence,
              AllOf(HasSubstr("A: in its mesh 6 faces have fewer than 8 contact elements across"),
                    HasSubstr("Remedy: set contact.components.A.element_edge_m to 0.012")));
  // After the remedy, or with the elements on the other side, there is no note.
  ScenarioContactComponent& said = with_contact.contact.components.emplace_back();
  said.name = "A";
  said.element_edge_m = 0.012;
  EXPECT_THAT(build_cell(with_contact)->import_notes, IsEmpty());
  said.element_edge_m.reset();
  said.role = ContactRole::target;
  EXPECT_THAT(build_cell(with_contact)->import_notes, IsEmpty());
}

}  // namespace
}  // namespace takt::test
