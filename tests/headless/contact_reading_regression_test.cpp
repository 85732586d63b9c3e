// Reports of surface contacts: in snapshots, report and CSV, in explanations; pressing is no collision.
// Reading has no effect on the run.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "server/contact/clearance/clearance_monitor.h"
#include "server/headless/csv_writer.h"
#include "server/headless/report.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/block_scenario_run.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using test::kGravity_m_s2;

std::filesystem::path scenario_file(const std::string& name) {
  return std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / (name + ".yaml");
}

Scenario block_with_contact() {
  ScenarioOptions options;
  options.overrides = {"solver.method=implicit", "solver.step_s=0.001"};
  options.level_of_detail = 3;
  return read_scenario(scenario_file("block_assembly"), options);
}

/// Force of other components on a component, by the contacts of a snapshot.
Vec3 pressed_with(const Snapshot& snapshot, int component) {
  Vec3 sum = Vec3::Zero();
  for (const ContactSample& pair : snapshot.contacts.pressing()) {
    if (pair.base == component) sum += pair.F_base_W.f;
    if (pair.target == component) sum -= pair.F_base_W.f;
  }
  return sum;
}

struct ContactReading : testing::Test {
  void SetUp() override {
    if constexpr (kMaxLevelOfDetail < 3) GTEST_SKIP() << "needs level of detail 3";
  }
};

// Grippers take P and C and let go of P at 9.9 s and of C at 11.0 s.
TEST_F(ContactReading, PressingIsNoCollisionAndIsInTheReport) {
  const Scenario scenario = block_with_contact();
  const auto cell = build_cell(scenario);
  ASSERT_TRUE(cell->clearance.enabled);
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = 11.5;
  options.program = scenario.controller_program;
  options.contact_extremes = true;
  const HeadlessResult result = run_headless(simulation, scenario, options);
  ASSERT_EQ(result.fault, "");
  const auto id = [&](const char* name) { return cell->description.find_component(name); };
  for (const auto& [jaw, part] : {std::pair("Gripper1/left_jaw", "P"), std::pair("Gripper2/left_jaw", "C")}) {
    const int a = id(jaw), b = id(part);
    const auto pressed = std::find_if(
        result.contact_extremes.begin(), result.contact_extremes.end(),
        [&](const auto& e) { return std::minmax(e.sample.base, e.sample.target) == std::minmax(a, b); });
    ASSERT_NE(pressed, result.contact_extremes.end()) << jaw;
    // Deep enough for the monitor, which would report it when the gripper opens.
    EXPECT_GT(pressed->sample.result.largest_penetration_m, 5.0 * ClearanceMonitor::kTouching_m) << jaw;
    EXPECT_GT(pressed->sample.result.normal_force_N, 140.0) << jaw;
    EXPECT_GT(pressed->time_s, 3.0) << jaw;
  }
  EXPECT_TRUE(result.collisions.empty()) << result.collisions.size();

  const RunInfo info{scenario.solver, 3, Pace::free, {}, {}};
  const auto report = nlohmann::json::parse(report_json(scenario, cell->description, info, result));
  const auto& contacts = report.at("contacts");
  EXPECT_EQ(contacts.at("omitted"), 0);
  EXPECT_GE(contacts.at("largest").size(), contacts.at("contacts").size());
  EXPECT_GT(contacts.at("calls").at("made").get<double>(), 1e4);
  EXPECT_GT(contacts.at("calls").at("skipped").get<double>(), 1e3);
  const auto of_table =
      std::find_if(contacts.at("contacts").begin(), contacts.at("contacts").end(), [](const auto& pair) {
        return (pair.at("base") == "B" && pair.at("target") == "Table1") ||
               (pair.at("base") == "Table1" && pair.at("target") == "B");
      });
  ASSERT_NE(of_table, contacts.at("contacts").end());
  EXPECT_NEAR(of_table->at("normal_force").get<double>(), 1.5 * kGravity_m_s2, 0.15);  // B, and C in it
}

// Up to where both grippers hold, by their programs.
TEST_F(ContactReading, ReadingChangesNeitherBitsNorCounts) {
  const Scenario scenario = block_with_contact();
  const auto cell = build_cell(scenario);
  HeadlessOptions options;
  options.duration_s = 6.0;
  options.program = scenario.controller_program;
  Simulation alone(cell), watched(cell);
  const HeadlessResult quiet = run_headless(alone, scenario, options);
  options.contact_extremes = true;
  std::vector<ContactSample> samples;
  std::size_t seen = 0;
  const HeadlessResult reported = run_headless(watched, scenario, options, [&](const Simulation& s) {
    s.read_contacts(samples);
    seen += samples.size();
    if (s.step_index() % 100 == 0) (void)s.explain(0);
  });
  EXPECT_GT(seen, 10000U);
  EXPECT_EQ(quiet.final_state.state_hash, reported.final_state.state_hash);
  EXPECT_GT(quiet.contact_counts.made, 10000U);
  EXPECT_GT(quiet.contact_counts.skipped, 1000U);
  EXPECT_EQ(quiet.contact_counts.made, reported.contact_counts.made);
  EXPECT_EQ(quiet.contact_counts.skipped, reported.contact_counts.skipped);
  EXPECT_EQ(quiet.contact_counts.boxes_apart, reported.contact_counts.boxes_apart);
  EXPECT_TRUE(quiet.contact_extremes.empty());
  EXPECT_GE(reported.contact_extremes.size(), 8U);
}

TEST_F(ContactReading, SnapshotsHoldContactsAndCountThoseWithoutRoom) {
  const auto cell = build_cell(block_with_contact());
  Simulation simulation(cell);
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
  Snapshot snapshot = simulation.make_snapshot();
  ASSERT_TRUE(snapshot.contacts.acting);
  EXPECT_EQ(snapshot.contacts.samples.size(), simulation.contact_capacity());
  ASSERT_EQ(snapshot.contacts.count, 4U);
  EXPECT_EQ(snapshot.contacts.omitted, 0U);
  for (const RigidBodyParameters& part : cell->parts) {
    const auto body = static_cast<std::size_t>(part.body);
    const Vec3 force = pressed_with(snapshot, part.body);
    EXPECT_NEAR(force.z(), cell->components[body].mass_kg * kGravity_m_s2,
                1e-3 * cell->components[body].mass_kg * kGravity_m_s2);
    EXPECT_LT((force - snapshot.components[body].F_Bo_W.f).norm(), 1e-9);
  }
  Snapshot small = snapshot;
  small.contacts.samples.resize(1);
  simulation.read_snapshot(small);
  EXPECT_EQ(small.contacts.count, 1U);
  EXPECT_EQ(small.contacts.omitted, 3U);
  EXPECT_EQ(small.contacts.samples[0].base, snapshot.contacts.samples[0].base);
  EXPECT_EQ(small.contacts.samples[0].F_base_W.f, snapshot.contacts.samples[0].F_base_W.f);

  const int p = cell->description.find_component("P"), table = cell->description.find_component("Table1");
  const Explanation of_p = simulation.explain(p);
  EXPECT_TRUE(of_p.surface_contact);
  ASSERT_EQ(of_p.pressing.size(), 1U);
  EXPECT_EQ(of_p.pressing[0].base + of_p.pressing[0].target, p + table);
  const std::string reported = describe(of_p, cell->description);
  EXPECT_NE(reported.find("At level of detail 3 Table1 (2.942 N) presses upon it."), std::string::npos)
      << reported;
  EXPECT_NE(reported.find("These forces alone carry it"), std::string::npos) << reported;
  EXPECT_EQ(simulation.explain(table).pressing.size(), 4U);

  ASSERT_EQ(simulation.set_level_of_detail(-1, 2), "");
  simulation.read_snapshot(snapshot);
  EXPECT_FALSE(snapshot.contacts.acting);
  EXPECT_EQ(snapshot.contacts.count, 0U);
  EXPECT_FALSE(simulation.explain(p).surface_contact);
  EXPECT_EQ(describe(simulation.explain(p), cell->description).find("level of detail 3"), std::string::npos);
}

TEST_F(ContactReading, CsvHasColumnsOfContactsAtLevelThreeOnly) {
  const test::TemporaryDirectory directory;
  for (const int level : {1, 3}) {
    ScenarioOptions options;
    options.level_of_detail = level;
    const auto cell = load_cell(scenario_file("contact/drop"), options);
    Simulation simulation(cell);
    const auto file = directory / "drop.csv";
    CsvWriter csv(file, simulation, 0.1);
    csv.record(simulation);
    while (simulation.time_s() < 1.0 - 1e-9) {
      ASSERT_TRUE(simulation.step({}));
      csv.record(simulation);
    }
    csv.close();
    std::ifstream stream(file);
    std::string header, row, last;
    std::getline(stream, header);
    while (std::getline(stream, row)) last = row;
    EXPECT_EQ(std::count(header.begin(), header.end(), ','), std::count(last.begin(), last.end(), ','));
    const std::string column = "contacts.contacts.Box-Plate.normal_force";
    const std::size_t at = header.find(column);
    ASSERT_EQ(at != std::string::npos, level == 3) << header;
    if (level < 3) continue;
    std::size_t place = 0;
    for (auto comma = std::count(header.begin(), header.begin() + static_cast<long>(at), ','); comma > 0;
         --comma)
      place = last.find(',', place) + 1;
    EXPECT_NEAR(std::stod(last.substr(place)), 0.5 * kGravity_m_s2, 0.05) << "at rest after 1 s";
  }
}

}  // namespace
}  // namespace takt
