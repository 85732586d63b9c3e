// The solver that a cell gets whose scenario names none.
#include <gmock/gmock.h>

#include <cmath>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

/// Three wrist joints about one vertical axis, as a stretched seven-axis arm has them.
std::string aligned_axes() {
  std::string text = "<robot name='r'><link name='base_link'/>\n";
  std::string parent = "base_link";
  for (const char* name : {"a", "b", "tool0"}) {
    text += "<joint name='turn_" + std::string(name) +
            "' type='revolute'><origin xyz='0 0 0.2'/><parent link='" + parent + "'/><child link='" + name +
            "'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' velocity='2' effort='500'/></joint>\n<link "
            "name='" +
            name +
            "'><inertial><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='" +
            (parent == "base_link"      ? "0.001"
             : std::string(name) == "b" ? "0.0005"
                                        : "0.02") +
            "'/></inertial></link>\n";
    parent = name;
  }
  return text + "</robot>\n";
}

class DefaultSolver : public testing::Test {
 protected:
  DefaultSolver() { directory_.write("r.urdf", aligned_axes()); }
  std::shared_ptr<const CellModel> load(const std::string& solver) {
    directory_.write("cell.yaml",
                     "takt_scenario: 1\nname: start\n" + solver +
                         "processes:\n  all: {members: all, level_of_detail: 2}\n"
                         "robots:\n  R: {urdf: r.urdf, initial_joints_rad: [0, 0, 0], trajectory: {end_rad: "
                         "[0.5, -0.5, 0.5], "
                         "max_velocity_rad_per_s: [1, 1, 1], max_acceleration_rad_per_s2: [5, 5, 5]}}\n");
    return load_cell(directory_ / "cell.yaml");
  }
  test::TemporaryDirectory directory_;
};

TEST_F(DefaultSolver, HoldsJointsWithAlignedAxesAtLevel2) {
  const auto cell = load("");
  ASSERT_TRUE(cell->dynamics_solver.has_value());
  EXPECT_EQ(cell->dynamics_solver->name, "implicit");
  Simulation simulation(cell);
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(simulation.step({})) << i;
  const Snapshot snapshot = simulation.make_snapshot();
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(snapshot.robots[0].position[i], i == 1 ? -0.5 : 0.5, 1e-3);
  // The explicit one that level 1 has does not: its step is too long for them.
  Simulation explicit_one(load("solver: {method: rk2}\n"));
  int steps = 0;
  while (steps < 3000 && explicit_one.step({})) ++steps;
  EXPECT_LT(steps, 3000);
}

TEST_F(DefaultSolver, IsTheOneThatIsNamed) {
  EXPECT_FALSE(load("solver: {method: rk2}\n")->dynamics_solver.has_value());
  EXPECT_EQ(load("solver: {dynamics: {method: cvode}}\n")->dynamics_solver->name, "cvode");
  EXPECT_EQ(load("solver: {method: rk4, dynamics: {method: esdirk}}\n")->dynamics_solver->name, "esdirk");
  EXPECT_EQ(load("solver: {step_s: 0.002}\n")->dynamics_solver->name, "implicit");
}

}  // namespace
}  // namespace takt
