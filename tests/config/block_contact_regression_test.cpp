// The block scenarios at LoD 3, by surface contact: ends against the drawings and against LoD 2, the load on
// the flange against statics, levels switched while running, the same bits with threads and with calls left
// out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "server/headless/in_process_controller.h"
#include "server/runtime/loop/worker_pool.h"
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

constexpr std::array<const char*, 4> kParts{"P", "C", "O", "B"};

/// Quantities by which both levels are compared, at each of the controller's periods.
struct Instant {
  std::array<Vec3, kParts.size()> p_WP;  ///< origins of the Parts
  double load_N = 0.0;                   ///< of Gripper2 and its load, on its flange, downwards
};

struct Trace {
  std::vector<Instant> instants;
  /// First time at which both jaws press upon a Part; only those of level 3 do.
  std::map<std::string, double> both_jaws_press_s;

  void note(const CellModel& cell, const Snapshot& s) {
    note_jaws(cell, s);
    if (std::abs(s.time_s - kPeriod_s * static_cast<double>(instants.size() + 1)) > 1e-9) return;
    Instant instant;
    for (std::size_t i = 0; i < kParts.size(); ++i)
      instant.p_WP[i] =
          s.components[static_cast<std::size_t>(cell.description.find_component(kParts[i]))].p_WB;
    instant.load_N = -s.robots[1].flange_load_W.f.z();
    instants.push_back(instant);
  }
  const Instant& at(double time_s) const {
    return instants.at(static_cast<std::size_t>(std::llround(time_s / kPeriod_s)) - 1);
  }

  static constexpr double kPeriod_s = 0.008;

 private:
  void note_jaws(const CellModel& cell, const Snapshot& s) {
    std::map<std::string, int> jaws;
    for (const ContactSample& sample : s.contacts.pressing()) {
      const auto name = [&](int id) { return cell.components[static_cast<std::size_t>(id)].name; };
      const bool jaw_is_base = name(sample.base).find("_jaw") != std::string::npos;
      if (jaw_is_base || name(sample.target).find("_jaw") != std::string::npos)
        ++jaws[name(jaw_is_base ? sample.target : sample.base)];
    }
    for (const auto& [part, count] : jaws) {
      if (count == 2) both_jaws_press_s.try_emplace(part, s.time_s);
    }
  }
};

TEST(BlockContact, TheAssemblyEndsAsDrawnAndFollowsLevel2) {
  Trace contact, substitute;
  const BlockRun r =
      test::run_block_scenario("block_assembly", at_level_3("cvode", "1e-6"),
                               [&](const CellModel& cell, const Snapshot& s) { contact.note(cell, s); });
  expect_held_and_near(r, 5e-4);
  const BlockRun level_2 = test::run_block_scenario(
      "block_assembly", {"processes.assembly.level_of_detail=2", "solver.step_s=0.001"},
      [&](const CellModel& cell, const Snapshot& s) { substitute.note(cell, s); });
  for (const char* part : kParts) {
    EXPECT_EQ(r.sample(r.result.final_state, part).partner,
              level_2.sample(level_2.result.final_state, part).partner)
        << part;
  }
  // (5.21): Gripper2 (3 kg) holds C (0.5 kg) still above B.
  EXPECT_NEAR(contact.at(9.8).load_N, 3.5 * test::kGravity_m_s2, 5e-5);
  EXPECT_NEAR(substitute.at(9.8).load_N, 3.5 * test::kGravity_m_s2, 5e-5);

  ASSERT_EQ(contact.instants.size(), 5250U);
  ASSERT_EQ(substitute.instants.size(), contact.instants.size());
  std::size_t apart = 0;
  for (std::size_t i = 0; i < contact.instants.size(); ++i) {
    const Instant &a = contact.instants[i], &b = substitute.instants[i];
    const double time_s = Trace::kPeriod_s * static_cast<double>(i + 1);
    for (std::size_t k = 0; k < kParts.size(); ++k)
      ASSERT_LE((a.p_WP[k] - b.p_WP[k]).norm(), 2.5e-4) << kParts[k] << " at " << time_s;
    // The loads differ while the jaws move, and while the held Part touches another one: C slides into B, the
    // assembly is lifted off the tables and put down.
    const bool may_differ = (time_s > 4.9 && time_s < 5.4) || (time_s > 10.2 && time_s < 11.1) ||
                            (time_s > 31.2 && time_s < 31.8) || (time_s > 36.6 && time_s < 38.4);
    if (may_differ) continue;
    if (std::abs(a.load_N - b.load_N) > 0.6) ++apart;
  }
  EXPECT_EQ(apart, 0U);

  // Jaws stand open 30 mm wider than the Part and close by 150 mm/s, 75 mm/s each; their servo of 200 rad/s
  // follows 2/w late.
  EXPECT_TRUE(substitute.both_jaws_press_s.empty());
  const std::map<std::string, double> closed_s{{"P", 3.8}, {"C", 4.9}, {"O", 16.0}, {"B", 31.2}};
  for (const auto& [part, time_s] : closed_s) {
    ASSERT_EQ(contact.both_jaws_press_s.count(part), 1U) << part;
    EXPECT_NEAR(contact.both_jaws_press_s.at(part) - time_s, 0.03 / 0.15 + 2.0 / 200.0, 0.02) << part;
  }
}

TEST(BlockContact, TheAssemblyEndsAtItsPlacesByTheLinearlyImplicitMethod) {
  const BlockRun r = test::run_block_scenario("block_assembly", at_level_3("rosenbrock", "1e-4"));
  expect_held_and_near(r, 5e-4);
}

// Noise of the accelerations within a solver's steps must not count as work that a braking axis does not give back.
TEST(BlockContact, TheRobotsDrawTheEnergyOfLevel2) {
  constexpr double kIdle_J = 90.0 * 42.0;
  const BlockRun contact = test::run_block_scenario("block_assembly", at_level_3("rosenbrock", "1e-4"));
  const BlockRun level_2 = test::run_block_scenario(
      "block_assembly", {"processes.assembly.level_of_detail=2", "solver.step_s=0.001"});
  for (std::size_t robot = 0; robot < 2; ++robot) {
    const auto moving_J = [&](const BlockRun& r) {
      return r.result.final_state.robots[robot].power.electrical_energy_J - kIdle_J;
    };
    EXPECT_GT(moving_J(level_2), 200.0);
    EXPECT_NEAR(moving_J(contact), moving_J(level_2), 1e-3 * moving_J(level_2));
  }
}

TEST(BlockContact, TheDisassemblyEndsAsDrawn) {
  // CVODE needs 1e-6: at 1e-5 a tolerance relative to heights of 0.7 m is coarser than the 3 um by which
  // parts sink in, and P, put down from 44 um, bounces. P ends 0.460 mm off by cvode, from 1e-6 on: grips that stick
  // draw it along. Where they slip is sensitive: rosenbrock 1e-4, 1e-5 and 1e-6 end at 0.574, 0.479 and 0.433 mm.
  expect_held_and_near(test::run_block_scenario("block_disassembly", at_level_3("cvode", "1e-6")), 5.6e-4);
  expect_held_and_near(test::run_block_scenario("block_disassembly", at_level_3("rosenbrock", "1e-4")), 6e-4);
}

TEST(BlockContact, TheAssemblyEndsAtItsPlacesWithDetailedDrives) {
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

TEST(BlockContact, SwitchesBetweenLevels1And3KeepTheAssembly) {
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

TEST(BlockContact, SwitchesBetweenLevels2And3KeepTheAssembly) {
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
  // B stands on the tables by substitute force, the Parts inserted into it press by contact.
  expect_assembled({}, {"contact.pairs=[{pair: [B, \"Table*\"], force: holding_spring}]"});
}

TEST(BlockContact, OneProcessRunsAtLevel3BesideOneAtLevel1) {
  // P and O are handled by contact, C and B by substitute forces; the pair of O and B has both levels, so the
  // lower one.
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

TEST(BlockContact, ThreadsAndSkippedCallsChangeNoBit) {
  ContactCallCounts plain, again, every, threads;
  const std::uint64_t hash = hash_of_12_s({}, 1, plain);
  EXPECT_EQ(hash_of_12_s({}, 1, again), hash);
  EXPECT_EQ(hash_of_12_s({"contact.cache_unmoved_pairs=false"}, 1, every), hash);
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
