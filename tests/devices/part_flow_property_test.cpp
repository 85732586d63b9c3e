// Sources and sinks of Parts: times of free fall, order of reuse, equal bits, memory, and cost.
#include "server/devices/part_flow.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>

#include "tests/support/device_cell.h"
#include "tests/support/reused_snapshots.h"

namespace takt {
namespace {

using test::DeviceCell;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Kind = DeviceNotice::Kind;

/// Of the centre of mass of a blank above its frame.
constexpr double kBlankCentre_m = 0.0401298;

/// A source of blanks above a sink; without contact on the way.
std::string falling(int count, const std::string& source, const std::string& more = "") {
  return "pools:\n  Blanks: {mesh: MESHES/P.obj, mass_kg: 0.3, hierarchy: 2, count: " +
         std::to_string(count) + "}\nsources:\n  Feeder: {pool: Blanks, pose: {position_m: [0, 0, 1]}, " +
         source + "}\nsinks:\n  Bin: {region: {center: {position_m: [0, 0, 0]}, size_m: [1, 1, 1]}}\n" + more;
}
const std::string kCoarseStep = "solver: {step_s: 0.004}\n";

std::string name_of(DeviceCell& cell, int part) {
  return cell.description().components[static_cast<std::size_t>(part)].name;
}

TEST(PartFlow, APartFallsFromTheSourceIntoTheSinkByTheLawOfFreeFall) {
  DeviceCell cell(DeviceCell::load_text(falling(3, "period_s: 0")));
  EXPECT_EQ(cell.component("Blanks_1").state, PartState::parked);
  EXPECT_EQ(cell.component("Blanks_1").partner, -1);
  EXPECT_EQ(cell.read("Feeder", "available"), 3.0);
  cell.run(0.05);
  EXPECT_TRUE(cell.notices().empty());
  cell.set("Feeder", "release", 1.0);
  cell.step();
  ASSERT_EQ(cell.notices().size(), 1U);
  EXPECT_EQ(cell.notices()[0].kind, Kind::part_entered);
  EXPECT_EQ(name_of(cell, cell.notices()[0].part), "Blanks_1");
  EXPECT_EQ(cell.component("Blanks_1").state, PartState::free);
  EXPECT_EQ(cell.read("Feeder", "available"), 2.0);
  EXPECT_EQ(cell.read("Feeder", "released"), 1.0);
  const double begin = cell.time_s() - 0.001;
  ASSERT_TRUE(cell.run_until([&] { return cell.read("Bin", "removed") == 1.0; }, 1.0));
  // The centre of mass falls from 1 m to 0.5 m; the sink decides at the begin of the step after.
  const double fall_s = std::sqrt(2.0 * (0.5 + kBlankCentre_m) / DeviceCell::kGravity);
  EXPECT_NEAR(cell.notices().back().time_s - begin, fall_s, 0.001 + 1e-9);
  EXPECT_GE(cell.notices().back().time_s - begin, fall_s - 1e-9);
  EXPECT_EQ(cell.component("Blanks_1").state, PartState::parked);
  EXPECT_EQ(cell.read("Bin", "part"), cell.description().find_component("Blanks_1"));
  // A level of `release` gives one Part alone.
  EXPECT_EQ(cell.read("Feeder", "released"), 1.0);
}

TEST(PartFlow, PartsComeBackInTheOrderInWhichTheyLeft) {
  DeviceCell cell(DeviceCell::load_text(kCoarseStep + falling(3, "period_s: 0.4, release: true")));
  cell.run(2.6);
  std::vector<std::string> entered;
  for (const DeviceNotice& notice : cell.notices())
    if (notice.kind == Kind::part_entered) entered.push_back(name_of(cell, notice.part));
  EXPECT_THAT(entered, ElementsAre("Blanks_1", "Blanks_2", "Blanks_3", "Blanks_1", "Blanks_2", "Blanks_3",
                                   "Blanks_1"));
  // The period is kept to the step: 0, 0.4, 0.8 and so on.
  int number = 0;
  for (const DeviceNotice& notice : cell.notices())
    if (notice.kind == Kind::part_entered) {
      EXPECT_NEAR(notice.time_s, 0.4 * number++, 1e-9);
    }
}

TEST(PartFlow, AnEmptyPoolAndATakenPlaceBlockTheSourceUntilTheyAreFree) {
  DeviceCell cell(
      DeviceCell::load_text("pools:\n  Blanks: {mesh: MESHES/P.obj, mass_kg: 0.3, hierarchy: 2, count: 2}\n"
                            "grounds:\n  Table: {mesh: MESHES/table.obj, convex: objects}\n"
                            "sources:\n  Feeder: {pool: Blanks, pose: {position_m: [0, 0, 0]}}\n"
                            "sinks:\n  Hand: {at: Table}\n"));
  cell.set("Hand", "enabled", 0.0);
  const auto pulse = [&] {
    cell.set("Feeder", "release", 1.0);
    cell.step();
    cell.set("Feeder", "release", 0.0);
    cell.step();
  };
  pulse();
  EXPECT_EQ(cell.read("Feeder", "released"), 1.0);
  cell.run(0.2);
  EXPECT_EQ(cell.partner("Blanks_1"), "Table");
  EXPECT_EQ(cell.component("Blanks_1").state, PartState::placed);
  pulse();  // the first one is still there
  EXPECT_EQ(cell.read("Feeder", "released"), 1.0);
  EXPECT_EQ(cell.read("Feeder", "blocked"), 1.0);
  cell.run(0.1);
  EXPECT_EQ(cell.read("Feeder", "blocked"), 1.0);
  cell.set("Hand", "enabled", 1.0);
  cell.step();
  cell.set("Hand", "enabled", 0.0);
  cell.step();
  EXPECT_EQ(cell.read("Hand", "removed"), 1.0);
  EXPECT_EQ(cell.read("Feeder", "released"), 2.0);
  EXPECT_EQ(cell.read("Feeder", "blocked"), 0.0);
  cell.run(0.1);
  EXPECT_EQ(cell.partner("Blanks_2"), "Table");
  pulse();  // Blanks_1 is available, its place is not
  EXPECT_EQ(cell.read("Feeder", "available"), 1.0);
  EXPECT_EQ(cell.read("Feeder", "blocked"), 1.0);
}

TEST(PartFlow, AParkedPartCannotBeMovedOrAttached) {
  DeviceCell cell(DeviceCell::load_text(falling(2, "period_s: 0")));
  cell.step();
  Simulation& simulation = cell.simulation();
  const int parked = cell.description().find_component("Blanks_2");
  EXPECT_THAT(simulation.set_component_state(parked, {}, {}),
              HasSubstr("Blanks_2 is parked, outside of the cell"));
  EXPECT_THAT(simulation.attach(parked, cell.description().find_component("Blanks_1")),
              HasSubstr("is parked"));
}

TEST(PartFlow, AnAttachedPartIsLetGoBeforeItIsTakenOut) {
  DeviceCell cell(DeviceCell::load_text(
      "pools:\n  Blanks: {mesh: MESHES/P.obj, mass_kg: 0.3, hierarchy: 2, count: 2}\n"
      "parts:\n  Rider: {mesh: MESHES/P.obj, mass_kg: 0.1, hierarchy: 1, pose: {position_m: [0, 0, "
      "0.0805]}}\n"
      "grounds:\n  Table: {mesh: MESHES/table.obj, convex: objects}\n"
      "sources:\n  Feeder: {pool: Blanks, pose: {position_m: [0, 0, 0]}, release: true}\n"
      "sinks:\n  Waits: {at: Table}\n  Takes: {at: Table, held: true}\n"));
  for (const char* sink : {"Waits", "Takes"}) cell.set(sink, "enabled", 0.0);
  cell.run(0.3);
  const auto id = [&](const char* name) { return cell.description().find_component(name); };
  EXPECT_EQ(cell.simulation().attach(id("Blanks_1"), id("Table")), "");
  EXPECT_EQ(cell.simulation().attach(id("Rider"), id("Blanks_1")), "");
  cell.set("Waits", "enabled", 1.0);
  cell.run(0.1);
  EXPECT_EQ(cell.read("Waits", "removed"), 0.0);
  cell.set("Takes", "enabled", 1.0);
  cell.step();
  EXPECT_EQ(cell.read("Takes", "removed"), 1.0);
  EXPECT_EQ(cell.notices().back().kind, Kind::part_taken_off);
  EXPECT_EQ(cell.notices().back().other, id("Table"));
  EXPECT_EQ(cell.component("Blanks_1").state, PartState::parked);
  EXPECT_EQ(cell.component("Rider").partner, -1);
  cell.run(0.2);  // it falls onto the table
  EXPECT_EQ(cell.partner("Rider"), "Table");
  EXPECT_NEAR(cell.component("Rider").p_WB.z(), 0.0, 1e-3);
}

TEST(PartFlow, TenThousandPartsInAnHourKeepBitsAndMemory) {
  const auto model = DeviceCell::load_text(kCoarseStep + falling(20, "period_s: 0.36, release: true"));
  std::uint64_t hash = 0;
  for (int run = 0; run < 2; ++run) {
    Simulation simulation(model);
    std::size_t bytes = 0;
    int entered = 0;
    while (simulation.time_s() < 3600.0 - 1e-6) {
      ASSERT_TRUE(simulation.step({})) << simulation.fault();
      for (const DeviceNotice& notice : simulation.events().device_notices)
        entered += notice.kind == Kind::part_entered ? 1 : 0;
      if (simulation.step_index() == 10000) bytes = mallinfo2().uordblks;
    }
    EXPECT_EQ(entered, 10000);
    EXPECT_EQ(mallinfo2().uordblks, bytes);
    if (run == 0) hash = simulation.state_hash();
    EXPECT_EQ(simulation.state_hash(), hash);
  }
}

TEST(PartFlow, TheWorkOfAStepDoesNotDependOnTheSizeOfThePool) {
  SimulationStatistics small, large;
  for (auto [count, statistics] : {std::pair{5, &small}, {500, &large}}) {
    DeviceCell cell(DeviceCell::load_text(kCoarseStep + falling(count, "period_s: 0.36, release: true")));
    cell.run(36.0);
    *statistics = cell.simulation().statistics();
  }
  EXPECT_EQ(small.derivative_evaluations, large.derivative_evaluations);
  EXPECT_EQ(small.mpr_calls, large.mpr_calls);
  EXPECT_EQ(large.part_steps_skipped - small.part_steps_skipped, 495U * large.steps);
}

/// Blanks enter on a table, and a sink takes them when they lie.
std::string onto_table(int level) {
  return "processes:\n  all: {level_of_detail: " + std::to_string(level) +
         ", members: all}\n"
         "solver: {contact: {method: rosenbrock, step_s: 0.004}}\n"
         "contact:\n  defaults: {youngs_modulus_Pa: 1.0e+6, poisson_ratio: 0.3, layer_depth_m: 0.001, "
         "areal_damping_N_s_per_m3: 2.5e+5, friction: 0.3, friction_velocity_m_per_s: 0.001}\n"
         "pools:\n  Blanks: {mesh: MESHES/P.obj, mass_kg: 0.3, hierarchy: 2, count: 3}\n"
         "grounds:\n  Table: {mesh: MESHES/table.obj, convex: objects}\n"
         "sources:\n  Feeder: {pool: Blanks, pose: {position_m: [0, 0, 0.01]}, period_s: 0.2, release: "
         "true}\n"
         "sinks:\n  Hand: {at: Table}\n";
}

class PartFlowAtLevel : public ::testing::TestWithParam<int> {};

TEST_P(PartFlowAtLevel, AResetAndASavedStateGoOnWithTheSameBits) {
  const auto model = DeviceCell::load_text(onto_table(GetParam()));
  DeviceCell cell(model), restored(model);
  cell.run(0.5);
  std::vector<std::byte> bytes;
  EXPECT_EQ(cell.simulation().save_state(bytes), "");
  EXPECT_GE(cell.read("Hand", "removed"), 2.0);
  cell.run(0.7);
  EXPECT_GE(cell.read("Hand", "removed"), 5.0);
  EXPECT_EQ(cell.count(Kind::part_entered), 6U);
  const std::uint64_t hash = cell.simulation().state_hash();
  ASSERT_EQ(restored.simulation().restore_state(bytes), "");
  restored.run(0.7);
  EXPECT_EQ(restored.simulation().state_hash(), hash);
  EXPECT_EQ(restored.read("Hand", "removed"), cell.read("Hand", "removed"));
  cell.simulation().reset();
  EXPECT_EQ(cell.component("Blanks_1").state, PartState::parked);
  cell.run(1.2);
  EXPECT_EQ(cell.simulation().state_hash(), hash);
}

TEST_P(PartFlowAtLevel, SnapshotsHaveNoTracesOfEarlierOnes) {
  std::size_t entered = 0;
  test::expect_no_traces_of_earlier_samples(
      DeviceCell::load_text(onto_table(GetParam())), 1.2,
      [&](const DeviceCell& cell) { entered = cell.count(Kind::part_entered); });
  EXPECT_GT(entered, 4U);
}

INSTANTIATE_TEST_SUITE_P(Levels, PartFlowAtLevel, ::testing::Values(1, 2, 3));

TEST(PartFlow, APileThatWasAsleepFallsWhenItsLowestPartIsTakenOut) {
  for (const int level : {1, 3}) {
    const std::string text = onto_table(level) +
                             "parts:\n  Rider: {mesh: MESHES/P.obj, mass_kg: 0.1, hierarchy: 1, pose: "
                             "{position_m: [0, 0, 0.0905]}}\n"
                             "sleeping: {method: threshold, time_to_sleep_s: 0.1}\n";
    DeviceCell cell(DeviceCell::load_text(text));
    cell.set("Hand", "enabled", 0.0);
    cell.run(0.1);
    cell.set("Feeder", "release", 0.0);
    cell.run(1.0);
    EXPECT_NEAR(cell.component("Rider").p_WB.z(), 0.08, 1e-3);
    cell.set("Hand", "enabled", 1.0);
    cell.step();
    EXPECT_EQ(cell.component("Blanks_1").state, PartState::parked);
    cell.set("Hand", "enabled", 0.0);
    cell.run(0.4);
    EXPECT_NEAR(cell.component("Rider").p_WB.z(), 0.0, 1e-3) << level;
  }
}

TEST(PartFlow, MistakesInTheScenarioAreNamed) {
  const auto error_of = [](const std::string& text) {
    try {
      DeviceCell::load_text(text);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(error_of("sources:\n  Feeder: {pool: Blank}\n"), HasSubstr("a pool"));
  EXPECT_THAT(error_of(falling(2, "period_s: -1")), HasSubstr("period_s"));
  EXPECT_THAT(error_of(falling(0, "period_s: 1")), HasSubstr("count"));
  EXPECT_THAT(error_of("pools:\n  Blanks: {mesh: MESHES/P.obj, mass_kg: 0.3, hierarchy: 2, count: 2}\n"
                       "sinks:\n  Bin: {held: true}\n"),
              HasSubstr("neither 'at' nor 'region'"));
  EXPECT_THAT(error_of(falling(2, "period_s: 1",
                               "parts:\n  Blanks_2: {mesh: MESHES/P.obj, mass_kg: 1, hierarchy: 1}\n")),
              HasSubstr("Blanks_2"));
}

TEST(PartFlow, TheScenarioOfTheLibraryKeepsItsPeriod) {
  DeviceCell cell(DeviceCell::load_device("source_and_sink"));
  cell.run(10.0);
  // One falls for 0.29 s, so the last of 28 (at 9.72 s) is just there.
  EXPECT_EQ(cell.read("Feeder", "released"), 28.0);
  EXPECT_EQ(cell.read("Bin", "removed"), 27.0);
}

}  // namespace
}  // namespace takt
