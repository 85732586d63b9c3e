// The block scenarios at LoD 3, by surface contact: ends against the drawings and against LoD 2, the load on
// the flange against statics, levels switched while running, the same bits with threads and with calls left
// out.
#include <gtest/gtest.h>

#include <algorithm>

#include "server/headless/in_process_controller.h"
#include "server/runtime/worker_pool.h"
#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

using test::BlockRun;
using Overrides = std::vector<std::string>;

Overrides at_level_3(const std::string& solver, const std::string& tolerance) {
  return {"processes.assembly.level_of_detail=3", "solver.method=" + solver, "solver.tolerance=" + tolerance,
          "solver.step_s=0.008"};
}

double largest_error_m(const Scenario& scenario, const CellModel& cell, const Snapshot& end) {
  double largest = 0.0;
  for (const ExpectedPose& expected : scenario.expected) {
    const auto id = static_cast<std::size_t>(cell.description.find_component(expected.part));
    largest = std::max(largest, pose_error(end.components[id], expected.X_WB).position_m);
  }
  return largest;
}

void expect_held_and_near(const BlockRun& r, double tolerance_m) {
  ASSERT_EQ(r.result.fault, "");
  EXPECT_EQ(r.lost_part_steps, 0U);
  EXPECT_LE(largest_error_m(r.scenario, *r.cell, r.result.final_state), tolerance_m);
}

TEST(BlockContact, AssemblyEndsWhereTheDrawingsSayAndAsAtLevel2) {
  double load_N = 0.0;
  const BlockRun r = test::run_block_scenario("block_assembly", at_level_3("cvode", "1e-6"),
                                              [&](const CellModel&, const Snapshot& s) {
                                                if (s.time_s <= 9.8 + 1e-9)
                                                  load_N = -s.robots[1].flange_load_W.f.z();
                                              });
  expect_held_and_near(r, 5e-4);
  // (5.21): Gripper2 (3 kg) holds C (0.5 kg) still above B.
  EXPECT_NEAR(load_N, 3.5 * test::kGravity, 5e-4);
  const BlockRun level_2 = test::run_block_scenario(
      "block_assembly", {"processes.assembly.level_of_detail=2", "solver.step_s=0.001"});
  for (const char* part : {"P", "C", "O", "B"}) {
    const ComponentSample& a = r.sample(r.result.final_state, part);
    const ComponentSample& b = level_2.sample(level_2.result.final_state, part);
    EXPECT_LE((a.p_WB - b.p_WB).norm(), 2.5e-4) << part;
    EXPECT_EQ(a.partner, b.partner) << part;
  }
}

TEST(BlockContact, AssemblyByTheLinearlyImplicitMethod) {
  const BlockRun r = test::run_block_scenario("block_assembly", at_level_3("rosenbrock", "1e-4"));
  expect_held_and_near(r, 5e-4);
}

TEST(BlockContact, DisassemblyEndsWhereTheDrawingsSay) {
  // CVODE needs 1e-6: at 1e-5 a tolerance relative to heights of 0.7 m is coarser than the 3 um by which
  // parts sink in, and P, put down from 44 um, bounces.
  expect_held_and_near(test::run_block_scenario("block_disassembly", at_level_3("cvode", "1e-6")), 5e-4);
  expect_held_and_near(test::run_block_scenario("block_disassembly", at_level_3("rosenbrock", "1e-4")), 5e-4);
}

TEST(BlockContact, WithDetailedDrivesWhoseFrictionSticks) {
  const BlockRun r = test::run_block_scenario("block_assembly_kr16", at_level_3("cvode", "1e-5"));
  expect_held_and_near(r, 5e-4);
  EXPECT_GT(r.result.statistics.solver.mode_switches, 100U);
}

struct Switch {
  double time_s;
  int level;
};

/// The block assembly, its levels switched at these times.
void expect_assembled(const std::vector<Switch>& switches, const Overrides& more = {}) {
  ScenarioOptions options;
  options.overrides = at_level_3("cvode", "1e-6");
  options.overrides.insert(options.overrides.end(), more.begin(), more.end());
  const Scenario scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "block_assembly.yaml", options);
  const auto cell = build_cell(scenario);
  Simulation simulation(cell);
  InProcessController controller(scenario.controller_program.string(), simulation);
  Snapshot before = simulation.make_snapshot(), after = before;
  std::size_t next = 0;
  while (simulation.time_s() < scenario.duration_s - 1e-9) {
    if (next < switches.size() && simulation.time_s() >= switches[next].time_s - 1e-9) {
      simulation.read_snapshot(before);
      ASSERT_EQ(simulation.set_level_of_detail(-1, switches[next].level), "");
      simulation.read_snapshot(after);
      for (std::size_t i = 0; i < before.components.size(); ++i)
        EXPECT_LE((before.components[i].p_WB - after.components[i].p_WB).norm(), 1e-9)
            << switches[next].time_s;
      ++next;
    }
    ASSERT_TRUE(simulation.step(controller.commands(simulation))) << simulation.fault();
    simulation.read_snapshot(after);
    for (const RigidBodyParameters& part : cell->parts)
      ASSERT_GE(after.components[static_cast<std::size_t>(part.body)].partner, 0)
          << cell->components[static_cast<std::size_t>(part.body)].name << " at " << after.time_s;
  }
  EXPECT_EQ(next, switches.size());
  EXPECT_LE(largest_error_m(scenario, *cell, after), 3e-4);
}

TEST(BlockContact, LevelsSwitchedBetween1And3WhileRunning) {
  // Jaws close; P lifted; both hold; P put down; O with P carried; the whole assembly carried, and put down.
  expect_assembled({{1.0, 1},
                    {3.9, 3},
                    {4.6, 1},
                    {6.0, 3},
                    {7.504, 1},
                    {9.96, 3},
                    {18.504, 1},
                    {21.0, 3},
                    {24.0, 1},
                    {31.0, 3},
                    {33.0, 1},
                    {40.0, 3}});
}

TEST(BlockContact, LevelsSwitchedBetween2And3WhileRunning) {
  expect_assembled({{1.0, 2},
                    {3.9, 3},
                    {4.6, 2},
                    {6.0, 3},
                    {7.504, 2},
                    {9.96, 3},
                    {18.504, 2},
                    {21.0, 3},
                    {24.0, 2},
                    {31.0, 3},
                    {33.0, 2},
                    {40.0, 3}});
}

TEST(BlockContact, APartHeldBySubstituteForceIsPressedByContact) {
  // B stands on the tables by substitute force, what is put into it presses by contact.
  expect_assembled({}, {"contact.pairs=[{pair: [B, \"Table*\"], interaction: substitute}]"});
}

TEST(BlockContact, OneProcessAtLevel3BesideOneAtLevel1) {
  // P and O are handled by contact, C and B by substitute forces; what O and B do to each other is of both,
  // so of the lower one.
  Overrides overrides = at_level_3("cvode", "1e-6");
  overrides.push_back(
      "processes={left: {level_of_detail: 3, members: [P, O, Robot1, Gripper1]}, "
      "right: {level_of_detail: 1, members: [C, B, Robot2, Gripper2]}}");
  const BlockRun r = test::run_block_scenario("block_assembly", overrides);
  expect_held_and_near(r, 5e-4);
}

std::uint64_t hash_of_12_s(const Overrides& more, int threads, ContactCallCounts& counts) {
  ScenarioOptions options;
  options.overrides = at_level_3("rosenbrock", "1e-4");
  options.overrides.insert(options.overrides.end(), more.begin(), more.end());
  const Scenario scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "block_assembly.yaml", options);
  const auto cell = build_cell(scenario);
  std::optional<WorkerPool> pool;
  Simulation simulation(cell);
  if (threads > 1) simulation.set_executor(&pool.emplace(threads, 0, WorkerPool::Sharing::always), 0);
  HeadlessOptions headless;
  headless.duration_s = 12.0;
  headless.program = scenario.controller_program;
  const HeadlessResult result = run_headless(simulation, scenario, headless);
  EXPECT_EQ(result.fault, "");
  counts = simulation.contact_counts();
  return result.final_state.state_hash;
}

TEST(BlockContact, TheSameBitsWithThreadsAndWithCallsLeftOut) {
  ContactCallCounts plain, again, every, threads;
  const std::uint64_t hash = hash_of_12_s({}, 1, plain);
  EXPECT_EQ(hash_of_12_s({}, 1, again), hash);
  EXPECT_EQ(hash_of_12_s({"contact.optimize_calls=false"}, 1, every), hash);
  for (const int n : {1, 2, 3}) {
    EXPECT_EQ(hash_of_12_s({"contact.parallel=true"}, n, threads), hash) << n;
    EXPECT_EQ(threads.made, plain.made) << n;
    EXPECT_EQ(threads.elements, plain.elements) << n;
  }
  EXPECT_GT(plain.skipped, 0U);
  EXPECT_EQ(every.skipped, 0U);
  EXPECT_GT(every.made, plain.made);
}

}  // namespace
}  // namespace takt
