// Components of one mesh share all that is made from it, and the cell is the same as if each had a file of its own.
#include "server/geometry/surface/shared_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/model/model_hash.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/glb_file.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class SharedMeshTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* file : {"u.obj", "copy.obj"}) directory_.write(file, obj_text("u", u_shape()));
  }

  std::shared_ptr<const CellModel> load(const std::string& of_a, const std::string& of_b,
                                        const std::string& contact = "{}") {
    directory_.write(
        "s.yaml",
        "takt_scenario: 1\nname: test\nsolver: {method: rk2, step_s: 0.001, contact: {method: rosenbrock, "
        "tolerance: 1.0e-4, step_s: 0.001}}\n"
        "processes: {p: {level_of_detail: 3, members: all}}\ncollision_checking: {enabled: true}\n"
        "contact: " +
            contact +
            "\nparts:\n"
            "  A: {mass_kg: 1, hierarchy: 1, " +
            of_a +
            "}\n"
            "  B: {mass_kg: 1, hierarchy: 1, pose: {position_m: [0.5, 0, 0]}, " +
            of_b + "}\n");
    return load_cell(directory_ / "s.yaml");
  }

  TemporaryDirectory directory_;
};

TEST_F(SharedMeshTest, PartsOfOneMeshShareAllThatIsMadeFromIt) {
  const auto cell = load("mesh: u.obj", "mesh: u.obj");
  EXPECT_EQ(&cell->components[0].convex.shapes(), &cell->components[1].convex.shapes());
  EXPECT_EQ(cell->contact.surfaces.at(0), cell->contact.surfaces.at(1));
  EXPECT_EQ(cell->description.components[0].mesh, cell->description.components[1].mesh);
  ASSERT_EQ(cell->clearance.bodies.size(), 2U);
  EXPECT_NE(cell->clearance.bodies[0].solid, nullptr);
  EXPECT_EQ(cell->clearance.bodies[0].solid, cell->clearance.bodies[1].solid);
}

TEST_F(SharedMeshTest, SharingChangesNothing) {
  const auto shared = load("mesh: u.obj", "mesh: u.obj");
  const auto apart = load("mesh: u.obj", "mesh: copy.obj");
  EXPECT_NE(apart->contact.surfaces.at(0), apart->contact.surfaces.at(1));
  EXPECT_EQ(model_hash(*shared), model_hash(*apart));
  EXPECT_EQ(shared->description.components[1].mesh->vertices,
            apart->description.components[1].mesh->vertices);
  ASSERT_EQ(shared->convex_imports.size(), 2U);
  EXPECT_EQ(shared->convex_imports[1].component, "B");
  EXPECT_EQ(shared->convex_imports[1].gained, apart->convex_imports[1].gained);
}

TEST_F(SharedMeshTest, NotesNameEachComponent) {
  const auto cell = load("mesh: u.obj", "mesh: u.obj");
  const auto apart = load("mesh: u.obj", "mesh: copy.obj");
  const auto sentences = [](const CellModel& model) {
    std::vector<std::string> all;
    for (const ImportNote& note : model.import_notes) all.push_back(note.sentence);
    return all;
  };
  EXPECT_EQ(sentences(*cell), sentences(*apart));
  EXPECT_THAT(sentences(*cell), testing::Contains(HasSubstr("contact.components.B.element_edge_m")));
}

TEST_F(SharedMeshTest, WhatIsStatedForOneComponentIsItsOwn) {
  const auto scaled = load("mesh: u.obj", "mesh: u.obj, mesh_scale: 0.5");
  EXPECT_NE(&scaled->components[0].convex.shapes(), &scaled->components[1].convex.shapes());
  EXPECT_NE(scaled->contact.surfaces.at(0), scaled->contact.surfaces.at(1));
  const auto source = load("mesh: u.obj", "mesh: u.obj, convex: objects");
  EXPECT_NE(&source->components[0].convex.shapes(), &source->components[1].convex.shapes());
  EXPECT_EQ(source->contact.surfaces.at(0), source->contact.surfaces.at(1));
  const auto edge = load("mesh: u.obj", "mesh: u.obj", "{components: {B: {element_edge_m: 0.01}}}");
  EXPECT_EQ(&edge->components[0].convex.shapes(), &edge->components[1].convex.shapes());
  EXPECT_NE(edge->contact.surfaces.at(0), edge->contact.surfaces.at(1));
}

TEST_F(SharedMeshTest, EachFileIsReadOnce) {
  MeshFiles files;
  MeshLibrary library(files);
  const auto first = library.mesh(directory_ / "u.obj", 1.0);
  directory_.write("u.obj", "no mesh");
  EXPECT_EQ(library.mesh(directory_ / "u.obj", 1.0), first);
  // A mesh that cannot be read is asked for again.
  for (int i = 0; i < 2; ++i) EXPECT_THROW((void)library.mesh(directory_ / "u.obj", 2.0), MeshError);
}

TEST_F(SharedMeshTest, FansOfNeedlesAreResampledAndReportedByThemselves) {
  directory_.write("n.obj", obj_text("n", prism(0.01, 0.02, 200, false)));
  const auto sentence = [](const CellModel& cell) {
    std::string all;
    for (const ImportNote& note : cell.import_notes)
      if (note.sentence.find("as contact elements") != std::string::npos) all += note.sentence + "\n";
    return all;
  };
  const auto by_itself = load("mesh: n.obj", "mesh: u.obj", "{resample: auto}");
  EXPECT_THAT(sentence(*by_itself),
              AllOf(HasSubstr("A: flat faces have cells of at most "),
                    HasSubstr("`contact.components.A.resample: never`"), Not(HasSubstr("B: flat"))));
  // Without the note of the needles, which the other one has.
  const auto needles = [](const CellModel& cell) {
    return std::count_if(cell.import_notes.begin(), cell.import_notes.end(), [](const ImportNote& note) {
      return note.sentence.find("needles") != std::string::npos;
    });
  };
  EXPECT_EQ(needles(*by_itself), 0);
  const auto never =
      load("mesh: n.obj", "mesh: u.obj", "{resample: auto, components: {A: {resample: never}}}");
  EXPECT_EQ(sentence(*never), "");
  EXPECT_NE(model_hash(*never), model_hash(*by_itself));
  EXPECT_EQ(needles(*never), 1);
  EXPECT_EQ(model_hash(*load("mesh: n.obj", "mesh: u.obj")), model_hash(*by_itself));
  EXPECT_THAT(sentence(*load("mesh: n.obj", "mesh: u.obj", "{resample: always}")),
              AllOf(HasSubstr("A: flat"), HasSubstr("B: flat")));
  // One mesh, two kinds of elements.
  const auto both =
      load("mesh: n.obj", "mesh: n.obj", "{resample: auto, components: {B: {resample: never}}}");
  EXPECT_NE(both->contact.surfaces.at(0), both->contact.surfaces.at(1));
  EXPECT_THAT(
      [&] { load("mesh: n.obj", "mesh: u.obj", "{resample: sometimes}"); },
      testing::ThrowsMessage<ScenarioError>(AllOf(HasSubstr("contact.resample"), HasSubstr("auto, always"))));
}

TEST_F(SharedMeshTest, AGlbFileIsReadOnceForAllItsNodes) {
  directory_.write("cell.glb", glb_cell());
  MeshFiles files;
  MeshLibrary library(files);
  const std::string file = (directory_ / "cell.glb").string();
  const auto housing = library.mesh(file + "#Housing", 1.0);
  directory_.write("cell.glb", "no mesh");
  EXPECT_EQ(library.mesh(file + "#Frame/Bolt", 1.0)->mesh().triangles.size(), 4U);
  EXPECT_EQ(list_mesh_nodes(file + "#Housing", 1.0, files).size(), 1U);
  EXPECT_THROW((void)list_mesh_nodes(file, 1.0), MeshError);
}

}  // namespace
}  // namespace takt::test
