// Convex shapes in a scenario, and the report of an import that loses or gains volume.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class ConvexImportTest : public testing::Test {
 protected:
  void SetUp() override {
    directory_.write("u.obj", obj_text("u", u_shape()));
    directory_.write("cube.obj", obj_text("cube", box_mesh({0.1, 0.1, 0.1})));
    const TriangleMesh left = box_mesh({0.02, 0.08, 0.05}, {0.01, 0.04, 0.0});
    const TriangleMesh right = box_mesh({0.02, 0.08, 0.05}, {0.09, 0.04, 0.0});
    const TriangleMesh floor = box_mesh({0.06, 0.02, 0.05}, {0.05, 0.01, 0.0});
    directory_.write("legs.obj", obj_text("left", left) + obj_text("right", right, 8));
    directory_.write("by_hand.obj",
                     obj_text("left", left) + obj_text("right", right, 8) + obj_text("floor", floor, 16));
  }

  std::shared_ptr<const CellModel> load(const std::string& convex, const ScenarioOptions& options = {},
                                        const ImportOptions& import = {}) {
    directory_.write("s.yaml",
                     "takt_scenario: 1\nname: test\nparts:\n  A: {mesh: u.obj, mass_kg: 1, hierarchy: 2" +
                         (convex.empty() ? "" : ", convex: " + convex) + "}\n");
    return load_cell(directory_ / "s.yaml", options, import);
  }
  std::string error(const std::string& convex, const ScenarioOptions& options = {}) {
    try {
      load(convex, options);
    } catch (const std::exception& e) {
      return e.what();
    }
    return {};
  }

  TemporaryDirectory directory_;
};

TEST_F(ConvexImportTest, AHullThatFillsAPocketIsReported) {
  for (const char* convex : {"", "hull", "{method: hull}", "{max_volume_error: 0.5}"}) {
    const auto cell = load(convex);
    ASSERT_EQ(cell->import_notes.size(), 1U) << convex;
    EXPECT_EQ(cell->import_notes[0].component, "A");
    EXPECT_EQ(cell->import_notes[0].shapes.value().hulls, 1);
    EXPECT_NEAR(cell->import_notes[0].shapes.value().volume_error, 180.0 / 220.0, 2e-3);
    EXPECT_THAT(cell->import_notes[0].sentence,
                AllOf(HasSubstr("A: "), HasSubstr("convex hull"), HasSubstr("81.")));
    ASSERT_EQ(cell->convex_imports.size(), 1U);
    EXPECT_EQ(cell->convex_imports[0].method, "hull");
  }
}

TEST_F(ConvexImportTest, TheReportedShareCanBeSet) {
  EXPECT_THAT(load("{method: hull, max_volume_error: 0.9}")->import_notes, IsEmpty());
  ScenarioOptions options;
  options.overrides = {"interaction.max_volume_error=0.9"};
  EXPECT_THAT(load("hull", options)->import_notes, IsEmpty());
  EXPECT_EQ(load("{method: hull, max_volume_error: 0.1}", options)->import_notes.size(), 1U);
}

TEST_F(ConvexImportTest, HandMadePiecesAreMeasured) {
  EXPECT_THAT(load("by_hand.obj")->import_notes, IsEmpty());
  const auto whole = load("{method: file, file: by_hand.obj}");
  EXPECT_THAT(whole->import_notes, IsEmpty());
  EXPECT_EQ(whole->convex_imports[0].method, "file");
  EXPECT_EQ(whole->convex_imports[0].hulls, 3);
  EXPECT_NEAR(whole->convex_imports[0].lost + whole->convex_imports[0].gained, 0.0, 1e-6);
  const auto cell = load("legs.obj");
  ASSERT_EQ(cell->import_notes.size(), 1U);
  EXPECT_NEAR(cell->convex_imports[0].lost, 60.0 / 220.0, 2e-3);
  EXPECT_NEAR(cell->convex_imports[0].gained, 0.0, 1e-6);
  EXPECT_THAT(cell->import_notes[0].sentence,
              AllOf(HasSubstr("2 convex parts (file)"), HasSubstr("legs.obj")));
  const auto objects = load("objects");
  ASSERT_EQ(objects->import_notes.size(), 1U);
  EXPECT_THAT(objects->import_notes[0].sentence, HasSubstr("1 convex part (objects)"));
}

TEST_F(ConvexImportTest, DecomposedPartsStayWithinTheBound) {
  if (!decomposition_available()) GTEST_SKIP() << "built without V-HACD";
  const TemporaryDirectory cache;
  static double ticks;
  ticks = 0.0;
  const ImportOptions import{cache.path(), [] { return ticks += 1.0; }};
  const std::string convex =
      "{method: vhacd, max_hulls: 8, resolution: 50000, max_vertices_per_hull: 32, best_plane: true}";
  const auto first = load(convex, {}, import);
  EXPECT_THAT(first->import_notes, IsEmpty());
  ASSERT_EQ(first->convex_imports.size(), 1U);
  EXPECT_EQ(first->convex_imports[0].method, "vhacd");
  EXPECT_FALSE(first->convex_imports[0].from_cache);
  EXPECT_EQ(first->convex_imports[0].seconds, 1.0);
  EXPECT_NEAR(first->convex_imports[0].solid_volume_m3, 220e-6, 1e-6);
  const auto second = load(convex, {}, import);
  EXPECT_TRUE(second->convex_imports[0].from_cache);
  ASSERT_EQ(second->components[0].convex.size(), first->components[0].convex.size());
  for (std::size_t i = 0; i < first->components[0].convex.size(); ++i)
    EXPECT_EQ(second->components[0].convex[i].vertices, first->components[0].convex[i].vertices);
  EXPECT_THAT(load("vhacd", {}, import)->import_notes, IsEmpty());

  // One part for a U cannot reach the required volume.
  const auto poor = load("{method: vhacd, max_hulls: 1, resolution: 50000, max_volume_error: 0.02}");
  ASSERT_EQ(poor->import_notes.size(), 1U);
  EXPECT_THAT(poor->import_notes[0].sentence,
              AllOf(HasSubstr("more than 2 %"), HasSubstr("max_hulls (now 1)")));
}

TEST_F(ConvexImportTest, WithoutVhacdTheScenarioIsRefused) {
  if (decomposition_available()) {
    EXPECT_EQ(error("{method: vhacd, resolution: 10000}"), "");
  } else {
    EXPECT_THAT(error("vhacd"),
                AllOf(HasSubstr("s.yaml"), HasSubstr("A: convex"), HasSubstr("built without V-HACD")));
  }
}

TEST_F(ConvexImportTest, InvalidParametersAreRefusedWithTheirPlace) {
  EXPECT_THAT(error("{method: vhacd, max_hulls: 0}"),
              AllOf(HasSubstr("s.yaml:4:"), HasSubstr("parts.A.convex.max_hulls"), HasSubstr("'0'"),
                    HasSubstr("a whole number in [1, 1024]")));
  EXPECT_THAT(
      error("{method: vhacd, resolution: 1e5}"),
      AllOf(HasSubstr("parts.A.convex.resolution"), HasSubstr("'1e5'"), HasSubstr("[10000, 10000000]")));
  EXPECT_THAT(error("{method: vhacd, max_vertices_per_hull: 3}"),
              HasSubstr("parts.A.convex.max_vertices_per_hull"));
  EXPECT_THAT(error("{method: vhacd, best_plane: maybe}"),
              AllOf(HasSubstr("parts.A.convex.best_plane"), HasSubstr("true or false")));
  for (const char* bad : {"0", "-0.1", "1.5", ".nan", "much"})
    EXPECT_THAT(error("{method: vhacd, max_volume_error: " + std::string(bad) + "}"),
                AllOf(HasSubstr("s.yaml:4:"), HasSubstr("parts.A.convex.max_volume_error")))
        << bad;
  EXPECT_THAT(error("{method: coacd}"), AllOf(HasSubstr("parts.A.convex.method"), HasSubstr("'coacd'"),
                                              HasSubstr("hull, objects, file, vhacd")));
  EXPECT_THAT(error("{method: vhacd, hulls: 3}"),
              AllOf(HasSubstr("parts.A.convex.hulls"), HasSubstr("unknown key"), HasSubstr("max_hulls")));
  EXPECT_THAT(error("{method: hull, max_hulls: 3}"), HasSubstr("unknown key"));
  EXPECT_THAT(error("{method: file}"), AllOf(HasSubstr("parts.A.convex.file"), HasSubstr("missing")));
  EXPECT_THAT(error("{method: file, file: none.obj}"), HasSubstr("does not exist"));
  EXPECT_THAT(error("[hull]"),
              AllOf(HasSubstr("s.yaml:4:"), HasSubstr("parts.A.convex"), HasSubstr("vhacd")));
  ScenarioOptions options;
  options.overrides = {"parts.A.convex={method: vhacd, max_hulls: 5000}"};
  EXPECT_THAT(error("", options), AllOf(HasSubstr("--set: parts.A.convex.max_hulls"), HasSubstr("1024")));
  options.overrides = {"interaction.max_volume_error=-1"};
  EXPECT_THAT(error("", options), HasSubstr("interaction.max_volume_error"));
}

}  // namespace
}  // namespace takt::test
