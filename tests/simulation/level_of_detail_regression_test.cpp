// Changes of the level of detail of the block scenario during its run: no quantity jumps, transients are
// small, and the assembly ends at its usual place.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "server/headless/in_process_controller.h"
#include "server/headless/report.h"
#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

struct LevelSwitch {
  double time_s;
  int level;
  /// Within half a second after it: largest distance of a component from its place in the run at
  /// level 1. At level 2 this includes the way that a drive lags behind its set-points.
  double allowed_transient_m;
};

// To level 2 drives start with the load they have (without: 0.1 mm at 21 s, 0.2 mm at 31.5 and 35 s).
// Jaws on their way are 2/w late at level 2: 2 x 75 mm/s / 200 rad/s = 0.75 mm.
// From level 2 to 1 between two set-points (every 8 ms) a moving arm waits for the next one: up to 0.73 mm.
const std::vector<LevelSwitch> kSwitches{
    {0.0, 2, 8e-4},  {1.0, 1, 1e-4},   // before the first motion; in motion, on a set-point
    {3.9, 2, 8e-4},  {4.6, 1, 1e-4},   // Gripper1 closes on P; P is lifted
    {6.0, 2, 5e-5},  {7.5, 1, 8e-4},   // P and C in the grippers; between two set-points
    {9.95, 2, 8e-4}, {12.0, 1, 1e-4},  // Gripper1 opens, C comes down; nothing held
    {17.0, 2, 5e-5}, {18.5, 1, 8e-4},  // O, with P in it, is lifted; between two set-points
    {21.0, 2, 1e-5}, {24.0, 1, 1e-4},  // O in B, Gripper1 still closed; open again
    {31.5, 2, 5e-5}, {33.0, 1, 1e-4},  // the assembly in Gripper2; carried, on a set-point
    {35.0, 2, 2e-5}, {39.0, 1, 1e-4},  // carried; Gripper2 opens
    {41.0, 2, 2e-5}, {41.5, 1, 1e-6},  // at rest
};

struct SwitchedRun {
  std::vector<ConnectionChange> changes;
  Snapshot end;
  double largest_jump_m = 0.0, largest_turn_rad = 0.0;  ///< of any component, at the instants of a switch
  double largest_speed_jump_m_per_s = 0.0;              ///< of a Part
  std::map<double, double> transient_m;                 ///< by time of the switch: see LevelSwitch
  std::string fault;
};

constexpr double kTransient_s = 0.5;

struct Block {
  explicit Block(const std::string& solver, const std::string& step = "0.001") {
    ScenarioOptions options;
    options.overrides = {"solver.method=" + solver, "solver.step_s=" + step};
    scenario =
        read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios/block_assembly.yaml", options);
    cell = build_cell(scenario);
  }
  Scenario scenario;
  std::shared_ptr<const CellModel> cell;
};

/// Positions of all components after every step.
using Paths = std::vector<std::vector<Vec3>>;

double largest_distance(const Snapshot& a, const Snapshot& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.components.size(); ++i)
    largest = std::max(largest, (a.components[i].p_WB - b.components[i].p_WB).norm());
  return largest;
}

SwitchedRun run_switched(const Block& block, const std::vector<LevelSwitch>& switches, int start_level,
                         Paths* paths = nullptr, const Paths* without = nullptr) {
  SwitchedRun r;
  Simulation simulation(block.cell);
  EXPECT_EQ(simulation.set_level_of_detail(-1, start_level), "");
  InProcessController controller(block.scenario.controller_program.string(), simulation);
  Snapshot before = simulation.make_snapshot(), after = before;
  std::size_t next = 0;
  double latest_s = -kTransient_s;
  const auto steps = static_cast<std::uint64_t>(std::llround(block.scenario.duration_s / block.cell->step_s));
  while (simulation.step_index() < steps) {
    if (next < switches.size() && simulation.time_s() >= switches[next].time_s - 1e-9) {
      simulation.read_snapshot(before);
      EXPECT_EQ(simulation.set_level_of_detail(-1, switches[next].level), "");
      simulation.read_snapshot(after);
      r.largest_jump_m = std::max(r.largest_jump_m, largest_distance(before, after));
      for (std::size_t i = 0; i < before.components.size(); ++i) {
        const ComponentSample &a = before.components[i], &b = after.components[i];
        r.largest_turn_rad = std::max(r.largest_turn_rad, a.q_WB.angularDistance(b.q_WB));
        EXPECT_EQ(a.partner, b.partner);
        if (a.state != PartState::fixed)
          r.largest_speed_jump_m_per_s = std::max(r.largest_speed_jump_m_per_s, (a.V_WB.v - b.V_WB.v).norm());
      }
      latest_s = switches[next].time_s;
      ++next;
    }
    if (!simulation.step(controller.commands(simulation))) {
      r.fault = simulation.fault();
      r.end = simulation.make_snapshot();
      return r;
    }
    for (const ConnectionChange& change : simulation.events().connection_changes) r.changes.push_back(change);
    const bool watched = without != nullptr && simulation.time_s() < latest_s + kTransient_s;
    if (paths == nullptr && !watched) continue;
    simulation.read_snapshot(after);
    if (paths != nullptr) {
      std::vector<Vec3>& path = paths->emplace_back();
      for (const ComponentSample& c : after.components) path.push_back(c.p_WB);
    }
    if (watched) {
      const std::vector<Vec3>& path = (*without)[simulation.step_index() - 1];
      for (std::size_t i = 0; i < path.size(); ++i)
        r.transient_m[latest_s] =
            std::max(r.transient_m[latest_s], (after.components[i].p_WB - path[i]).norm());
    }
  }
  r.end = simulation.make_snapshot();
  return r;
}

class LevelOfDetailSwitch : public testing::TestWithParam<std::string> {};

TEST_P(LevelOfDetailSwitch, NothingJumpsAndTheAssemblyEndsAtItsPlaces) {
  const Block block(GetParam());
  Paths path;
  const SwitchedRun kinematic = run_switched(block, {}, 1, &path);
  ASSERT_EQ(kinematic.fault, "");
  const SwitchedRun switched = run_switched(block, kSwitches, 1, nullptr, &path);
  ASSERT_EQ(switched.fault, "");
  EXPECT_LE(switched.largest_jump_m, 1e-9);
  EXPECT_LE(switched.largest_turn_rad, 1e-9);
  EXPECT_LE(switched.largest_speed_jump_m_per_s, 1e-9);
  for (const LevelSwitch& s : kSwitches)
    EXPECT_LE(switched.transient_m.at(s.time_s), s.allowed_transient_m)
        << "at " << s.time_s << " s to " << s.level;
  EXPECT_LE(max_position_error_m(block.scenario, block.cell->description, switched.end), 1e-4);
  EXPECT_LE(largest_distance(switched.end, kinematic.end), 1e-4);
  ASSERT_EQ(switched.changes.size(), kinematic.changes.size());
  for (std::size_t i = 0; i < switched.changes.size(); ++i) {
    EXPECT_EQ(switched.changes[i].part, kinematic.changes[i].part) << i;
    EXPECT_EQ(switched.changes[i].from, kinematic.changes[i].from) << i;
    EXPECT_EQ(switched.changes[i].to, kinematic.changes[i].to) << i;
  }
  EXPECT_EQ(run_switched(block, kSwitches, 1).end.state_hash, switched.end.state_hash);
}

// rk4: explicit steps; implicit: with the model's Jacobian; cvode: a method with a memory of earlier steps.
INSTANTIATE_TEST_SUITE_P(Solvers, LevelOfDetailSwitch, testing::Values("implicit", "rk4", "cvode"),
                         [](const auto& test) { return test.param; });

TEST(LevelOfDetail, EnergiesContinueWhenTheRobotIsDynamicAgain) {
  const Block block("implicit");
  Simulation simulation(block.cell);
  InProcessController controller(block.scenario.controller_program.string(), simulation);
  const auto run_to = [&](double time_s) {
    while (simulation.time_s() < time_s - 1e-9)
      ASSERT_TRUE(simulation.step(controller.commands(simulation))) << simulation.fault();
  };
  const auto power = [&](std::size_t robot) { return simulation.make_snapshot().robots[robot].power; };
  ASSERT_EQ(simulation.set_level_of_detail(-1, 2), "");
  run_to(2.0);
  const RobotPower before[] = {power(0), power(1)};
  for (const RobotPower& robot : before) EXPECT_GT(robot.electrical_energy_J, 100.0);
  ASSERT_EQ(simulation.set_level_of_detail(-1, 1), "");
  run_to(2.5);
  EXPECT_EQ(power(0).electrical_energy_J, 0.0) << "there is none at level 1";
  ASSERT_EQ(simulation.set_level_of_detail(-1, 2), "");
  for (const std::size_t robot : {std::size_t{0}, std::size_t{1}}) {
    EXPECT_EQ(power(robot).mechanical_energy_J, before[robot].mechanical_energy_J);
    EXPECT_EQ(power(robot).electrical_energy_J, before[robot].electrical_energy_J);
  }
  ASSERT_EQ(simulation.set_level_of_detail(-1, 2), "");
  EXPECT_EQ(power(0).electrical_energy_J, before[0].electrical_energy_J) << "2 to 2";
  run_to(3.0);
  EXPECT_GT(power(0).electrical_energy_J, before[0].electrical_energy_J + 20.0);
  simulation.reset();
  ASSERT_EQ(simulation.set_level_of_detail(-1, 2), "");
  EXPECT_EQ(power(0).electrical_energy_J, 0.0);
}

/// Explicit steps of 6 ms are too large if a dynamic robot holds a Part: the run must end ahead of any
/// invalid number. (Steps that are too large for the Parts alone are refused at load.)
TEST(LevelOfDetail, ATooLargeStepEndsWithAFaultAndKeepsTheLastState) {
  const Block block("rk2", "0.006");
  const SwitchedRun r = run_switched(block, {}, 2);
  EXPECT_NE(r.fault.find("gains energy without a cause"), std::string::npos) << r.fault;
  EXPECT_NE(r.fault.find("the last accepted state is kept"), std::string::npos) << r.fault;
  for (const ComponentSample& c : r.end.components) {
    EXPECT_TRUE(c.p_WB.allFinite());
    EXPECT_TRUE(c.q_WB.coeffs().allFinite());
  }
}

}  // namespace
}  // namespace takt
