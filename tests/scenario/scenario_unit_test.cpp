// Scenario files: every kind of wrong input is refused with file, line, key, the value found and the values
// allowed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/urdf_arm.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/kept_scenarios.h"

namespace takt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kBlock =
    std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "block_assembly.yaml";

class ScenarioFile : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() /
                 ("takt_scenario_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
                  ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(directory_);
    write("cube.obj",
          "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
          "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 "
          "5\nf 4 5 8\n");
    write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  void write(const std::string& name, const std::string& text) { std::ofstream(directory_ / name) << text; }

  /// Error text of loading this scenario; empty if it loads.
  std::string error(const std::string& yaml, const ScenarioOptions& options = {}) {
    write("s.yaml", yaml);
    try {
      read_scenario(directory_ / "s.yaml", options);
      if (!options.level_of_detail) test::keep_scenario(yaml, options.overrides, "");
      load_cell(directory_ / "s.yaml", options);
    } catch (const ScenarioError& e) {
      if (!options.level_of_detail) test::keep_scenario(yaml, options.overrides, e.what());
      return e.what();
    } catch (const std::exception& e) {
      return e.what();
    }
    return {};
  }
  std::filesystem::path directory_;
};

const std::string kHead = "takt_scenario: 1\nname: test\n";
const std::string kPart = "parts:\n  A: {mesh: cube.obj, mass_kg: 1, hierarchy: 2}\n";

TEST_F(ScenarioFile, AMinimalScenarioLoads) {
  EXPECT_EQ(error(kHead + kPart), "");
  const auto cell = load_cell(directory_ / "s.yaml");
  ASSERT_EQ(cell->parts.size(), 1U);
  EXPECT_NEAR((cell->parts[0].p_BBcm - Vec3(0.5, 0.5, 0.5)).norm(), 0.0, 1e-15);
  EXPECT_NEAR(cell->parts[0].I_BBcm_B(0, 0), 1.0 / 6.0, 1e-15);  // unit cube, 1 kg: m (a^2 + a^2) / 12
}

TEST_F(ScenarioFile, AnUnknownKeyIsRefused) {
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: cube.obj, mass_kg: 1, hierarchy: 2, weight: 3}\n"),
              AllOf(HasSubstr("s.yaml:4:"), HasSubstr("parts.A.weight"), HasSubstr("unknown key"),
                    HasSubstr("mass_kg")));
  EXPECT_THAT(error(kHead + "solvr: {}\n"),
              AllOf(HasSubstr("s.yaml:3:1"), HasSubstr("solvr"), HasSubstr("solver")));
}

TEST_F(ScenarioFile, AMissingKeyAndAWrongTypeAreRefused) {
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: cube.obj, hierarchy: 2}\n"),
              AllOf(HasSubstr("parts.A.mass_kg"), HasSubstr("missing"), HasSubstr("> 0 kg")));
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: cube.obj, mass_kg: heavy, hierarchy: 2}\n"),
              AllOf(HasSubstr("s.yaml:4:32"), HasSubstr("'heavy'"), HasSubstr("> 0 kg")));
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: cube.obj, mass_kg: .nan, hierarchy: 2}\n"),
              HasSubstr("mass_kg"));
  EXPECT_THAT(error(kHead + "world: {gravity_m_per_s2: [0, 0]}\n"),
              AllOf(HasSubstr("a list of 2 values"), HasSubstr("a list of 3 numbers m/s^2")));
  EXPECT_THAT(error("takt_scenario: 1\n"), AllOf(HasSubstr("name"), HasSubstr("missing")));
  EXPECT_THAT(error("takt_scenario: 2\nname: x\n"), AllOf(HasSubstr("takt_scenario"), HasSubstr("'2'")));
}

TEST_F(ScenarioFile, AMissingMeshAndAnOpenMeshAreRefused) {
  EXPECT_THAT(
      error(kHead + "parts:\n  A: {mesh: none.obj, mass_kg: 1, hierarchy: 2}\n"),
      AllOf(HasSubstr("s.yaml:4:"), HasSubstr("parts.A.mesh"), HasSubstr("none.obj"), HasSubstr("existing")));
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: open.obj, mass_kg: 1, hierarchy: 2}\n"),
              AllOf(HasSubstr("open.obj"), HasSubstr("edge")));
}

TEST_F(ScenarioFile, AHierarchyOutOfRangeIsRefused) {
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: cube.obj, mass_kg: 1, hierarchy: 0}\n"),
              AllOf(HasSubstr("s.yaml:4:"), HasSubstr("parts.A.hierarchy"), HasSubstr("'0'"),
                    HasSubstr("[1, 1000]")));
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: cube.obj, mass_kg: 1, hierarchy: 2.5}\n"),
              HasSubstr("'2.5'"));
}

TEST_F(ScenarioFile, NamesMustBeUniqueAndFitForTopics) {
  EXPECT_THAT(error(kHead + kPart + "grounds:\n  A: {mesh: cube.obj}\n"),
              AllOf(HasSubstr("'A'"), HasSubstr("unique")));
  EXPECT_THAT(error(kHead + "parts:\n  A/b: {mesh: cube.obj, mass_kg: 1, hierarchy: 2}\n"), HasSubstr("A/b"));
  EXPECT_THAT(error(kHead + "parts:\n  A: {mesh: cube.obj, mass_kg: 1, hierarchy: 2}\n"
                            "  A: {mesh: cube.obj, mass_kg: 2, hierarchy: 2}\n"),
              AllOf(HasSubstr("s.yaml:5:"), HasSubstr("twice")));
}

TEST_F(ScenarioFile, InvalidYamlIsReportedWithItsPlace) {
  EXPECT_THAT(error("takt_scenario: 1\nname: [a\n"),
              AllOf(HasSubstr("s.yaml:"), HasSubstr("not valid YAML")));
  EXPECT_THAT(error("- 1\n- 2\n"), HasSubstr("a mapping"));
  EXPECT_THROW(read_scenario(directory_ / "no.yaml"), ScenarioError);
}

TEST_F(ScenarioFile, OverridesAreCheckedLikeTheFile) {
  ScenarioOptions options;
  options.overrides = {"parts.A.mass_kg=2.5"};
  EXPECT_EQ(error(kHead + kPart, options), "");
  EXPECT_DOUBLE_EQ(load_cell(directory_ / "s.yaml", options)->parts[0].mass_kg, 2.5);
  options.overrides = {"parts.A.mass_kg=-1"};
  EXPECT_THAT(error(kHead + kPart, options), AllOf(HasSubstr("--set: parts.A.mass_kg"), HasSubstr("-1")));
  options.overrides = {"parts.A.colour=red"};
  EXPECT_THAT(error(kHead + kPart, options), HasSubstr("unknown key"));
  options.overrides = {"nonsense"};
  EXPECT_THAT(error(kHead + kPart, options), HasSubstr("key=value"));
  options = {};
  options.level_of_detail = 7;
  EXPECT_THAT(error(kHead + kPart, options), AllOf(HasSubstr("--lod"), HasSubstr("7")));
}

TEST_F(ScenarioFile, RobotsAndGrippersAreChecked) {
  write("robot.urdf", "<robot name='r'><link name='base_link'/></robot>");
  EXPECT_THAT(error(kHead + "robots:\n  R: {urdf: robot.urdf, flange_link: tool0, initial_joints_rad: []}\n"),
              AllOf(HasSubstr("robot.urdf"), HasSubstr("tool0")));
  EXPECT_THAT(error(kHead + "grippers:\n  G: {robot: R2}\n"),
              AllOf(HasSubstr("grippers.G.robot"), HasSubstr("'R2'")));
  EXPECT_THAT(error(kHead + "interaction: {algorithm: magic}\n"),
              AllOf(HasSubstr("interaction.algorithm"), HasSubstr("'magic'"), HasSubstr("substitute_force"),
                    HasSubstr("extended_substitute_force"), HasSubstr("partner_search")));
  EXPECT_THAT(error(kHead + "solver: {method: magic}\n"), AllOf(HasSubstr("'magic'"), HasSubstr("rk2")));
  EXPECT_THAT(error(kHead + "solver: {method: cvode, tolerance: 0}\n"),
              AllOf(HasSubstr("solver.tolerance"), HasSubstr("found 0"), HasSubstr("s.yaml:3")));
}

TEST_F(ScenarioFile, SolverNameAndToleranceReachTheCell) {
  write("s.yaml", kHead + "solver: {method: ida, step_s: 0.002, tolerance: 1e-9}\n" + kPart);
  const auto cell = load_cell(directory_ / "s.yaml");
  EXPECT_EQ(cell->solver.name, "ida");
  EXPECT_EQ(cell->solver.tolerance, 1e-9);
  EXPECT_EQ(cell->solver.step_s, 0.002);
  EXPECT_EQ(cell->step_s, 0.002);
}

TEST_F(ScenarioFile, TheInitialTwistOfAPartIsRead) {
  const auto twist = [](const std::string& text) {
    return kHead + "parts:\n  A: {mesh: cube.obj, mass_kg: 2, hierarchy: 2, twist: {" + text + "}}\n";
  };
  write("s.yaml", twist("velocity_m_per_s: [1, 2, 3], angular_velocity_rad_per_s: [0, 0, 0.5]"));
  Simulation simulation(load_cell(directory_ / "s.yaml"));
  const ComponentSample start = simulation.make_snapshot().components[0];
  EXPECT_LT((start.V_WB.v - Vec3(1, 2, 3)).norm(), 1e-15);
  EXPECT_LT((start.V_WB.w - Vec3(0, 0, 0.5)).norm(), 1e-15);
  for (int i = 0; i < 400; ++i) ASSERT_TRUE(simulation.step({}));
  // The centre of mass flies a parabola, the cube turns evenly about it.
  const Vec3 r(0.5, 0.5, 0.5), v_cm = Vec3(1, 2, 3) + Vec3(0, 0, 0.5).cross(r);
  const Vec3 p_cm = r + 0.4 * v_cm + Vec3(0, 0, -0.5 * 9.80665 * 0.4 * 0.4);
  const Mat3 R = Eigen::AngleAxisd(0.2, Vec3::UnitZ()).toRotationMatrix();
  const ComponentSample end = simulation.make_snapshot().components[0];
  EXPECT_LT((end.q_WB.toRotationMatrix() - R).norm(), 1e-8);
  EXPECT_LT((end.p_WB - (p_cm - R * r)).norm(), 1e-8);

  EXPECT_THAT(error(twist("velocity: [1, 2, 3]")),
              AllOf(HasSubstr("s.yaml:4:"), HasSubstr("parts.A.twist.velocity"), HasSubstr("unknown key"),
                    HasSubstr("velocity_m_per_s")));
  EXPECT_THAT(error(twist("velocity_m_per_s: [1, 2]")),
              AllOf(HasSubstr("parts.A.twist.velocity_m_per_s"), HasSubstr("a list of 2 values"),
                    HasSubstr("a list of 3 numbers m/s")));
  EXPECT_THAT(error(twist("angular_velocity_rad_per_s: [1, 2, .inf]")),
              AllOf(HasSubstr("parts.A.twist.angular_velocity_rad_per_s"), HasSubstr("rad/s")));
}

TEST(BlockScenario, TheScenarioHasThePublishedFigures) {
  const auto cell = load_cell(kBlock);
  const auto& components = cell->components;
  const std::array<std::tuple<const char*, double, int>, 4> facts{
      {{"P", 0.3, 2}, {"C", 0.5, 3}, {"O", 0.8, 3}, {"B", 1.0, 4}}};
  for (const auto& [name, mass, hierarchy] : facts) {
    const Component& c = components[static_cast<std::size_t>(cell->description.find_component(name))];
    EXPECT_EQ(c.mass_kg, mass);
    EXPECT_EQ(c.hierarchy, hierarchy);
    EXPECT_NEAR(c.substitute.k_tr_N_per_m, mass * 98066.5, 1e-6);
  }
  // O's pocket is off centre, so its centre of mass is too; C has none.
  EXPECT_LT(components[static_cast<std::size_t>(cell->description.find_component("O"))].p_BBcm.x(), -1e-4);
  EXPECT_NEAR(components[static_cast<std::size_t>(cell->description.find_component("C"))].p_BBcm.x(), 0.0,
              1e-12);
  EXPECT_EQ(cell->description.robots.size(), 2U);
  EXPECT_EQ(cell->description.robots[0].arm.joint_count(), 6);
}

}  // namespace
}  // namespace takt
