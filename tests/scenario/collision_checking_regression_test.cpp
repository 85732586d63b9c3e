// Robot programs checked for collisions in the block scenario: a correct program gives no event, a program
// that drives the gripper into the table gives time, place and depth; and the simulation is the same with and
// without.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/headless/report.h"
#include "tests/support/block_scenario_run.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using test::BlockRun;
using Kind = CollisionEvent::Kind;

TEST(CheckedPrograms, CorrectProgramsHaveNoReportAndTheSameHash) {
  for (const char* name : {"block_assembly", "block_disassembly"}) {
    const BlockRun checked = test::run_block_scenario(name);
    EXPECT_EQ(checked.result.fault, "");
    EXPECT_TRUE(checked.cell->clearance.enabled);
    EXPECT_GT(checked.cell->clearance.pairs.size(), 200U);
    EXPECT_TRUE(checked.result.collisions.empty()) << name << ": " << checked.result.collisions.size();
    const BlockRun unchecked = test::run_block_scenario(name, {"collision_checking.enabled=false"});
    EXPECT_EQ(checked.result.final_state.state_hash, unchecked.result.final_state.state_hash) << name;
    EXPECT_TRUE(unchecked.cell->clearance.pairs.empty());
    EXPECT_EQ(unchecked.result.statistics.clearance_pairs, 0U);
  }
}

TEST(CheckedPrograms, PadsThatCloseOnBAreReportedWithin20mmOfTheTable) {
  // From the program: the tips are 15 mm above the table when they grip B, on both tables.
  const BlockRun run =
      test::run_block_scenario("block_assembly", {"collision_checking.min_clearance_m=0.020",
                                                  "collision_checking.ignore=[['*_link', '*_link'], "
                                                  "['Robot1/*','Robot1/*']]"});
  int cleared = 0;
  for (const CollisionEvent& event : run.result.collisions) {
    EXPECT_NE(event.kind, Kind::collision);
    if (event.kind != Kind::clearance_restored) continue;
    ++cleared;
    EXPECT_NEAR(event.distance_m, 0.015, 1e-5);
    EXPECT_GT(event.duration_s, 1.0);
  }
  EXPECT_EQ(cleared, 4) << "two pads, two tables";
}

const char* const kProgram = R"(
period_s = 0.008
local WAY = {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0}
routine("Robot1", function(r)
  local target = pose{x = 0.05, y = 0.22, z = 0.7 - 0.003, roll = math.pi}
  r:move_to(target:offset(0, 0, 0.1), {speed = 0.35, acceleration_rad_per_s2 = 1.5})
  r:move_line(target, WAY)
  r:wait(0.2)
  r:move_line(target:offset(0, 0, 0.1), WAY)
end)
)";

TEST(CheckedPrograms, AGripperDrivenIntoTheTableIsReported) {
  const test::TemporaryDirectory directory;
  directory.write("into_the_table.lua", kProgram);
  BlockRun r;
  r.scenario = read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "block_assembly.yaml");
  r.cell = build_cell(r.scenario);
  Simulation simulation(r.cell);
  HeadlessOptions options;
  options.duration_s = 8.0;
  options.program = directory / "into_the_table.lua";
  // Height of the tips over the table, by step: they are 200 mm from the flange (config/meshes/README.md).
  std::vector<double> height;
  const auto gripper = static_cast<std::size_t>(r.id("Gripper1"));
  r.result = run_headless(simulation, r.scenario, options, [&](const Simulation& s) {
    const ComponentSample sample = s.make_snapshot().components[gripper];
    height.push_back((sample.p_WB + sample.q_WB * Vec3(0.0, 0.0, 0.2)).z() - 0.7);
  });
  ASSERT_EQ(r.result.fault, "");
  ASSERT_EQ(r.result.collisions.size(), 6U) << "for each pad: close, into the table, clear again";
  std::map<Kind, int> count;
  for (const CollisionEvent& event : r.result.collisions) {
    ++count[event.kind];
    const std::string pair = r.cell->description.checked_bodies[static_cast<std::size_t>(event.a)] + " " +
                             r.cell->description.checked_bodies[static_cast<std::size_t>(event.b)];
    EXPECT_TRUE(pair == "Table1 Gripper1/left_jaw" || pair == "Table1 Gripper1/right_jaw") << pair;
    ASSERT_GE(event.step, 1U);
    EXPECT_NEAR(event.time_s, 0.001 * static_cast<double>(event.step), 1e-12);
    EXPECT_NEAR(event.p_W.x(), 0.05, 0.015 + 1e-6) << "within the pad";
    EXPECT_NEAR(std::abs(event.p_W.y() - 0.22), 0.075 + 0.0075, 0.0075 + 1e-6);
    const double before = height[event.step - 1], now = height[event.step];
    switch (event.kind) {
      case Kind::clearance:
        EXPECT_GE(before, 0.005);
        EXPECT_LT(now, 0.005);
        EXPECT_NEAR(event.distance_m, now, 1e-9);
        break;
      case Kind::collision:
        EXPECT_GE(before, -1e-5);
        EXPECT_LT(now, -1e-5);
        EXPECT_NEAR(event.distance_m, now, 1e-9);
        EXPECT_NEAR(event.p_W.z(), 0.7 + 0.5 * now, 1e-8);
        break;
      case Kind::clearance_restored:
        EXPECT_LE(before, 0.006);
        EXPECT_GT(now, 0.006) << "one millimetre of hysteresis";
        EXPECT_NEAR(event.distance_m, *std::min_element(height.begin(), height.end()), 1e-9);
        EXPECT_NEAR(event.distance_m, -0.003, 1e-4);
        EXPECT_GT(event.duration_s, 0.2);
        break;
    }
  }
  EXPECT_EQ(count[Kind::clearance], 2);
  EXPECT_EQ(count[Kind::collision], 2);
  EXPECT_EQ(count[Kind::clearance_restored], 2);

  const RunInfo info;
  const auto report = nlohmann::json::parse(report_json(r.scenario, r.cell->description, info, r.result));
  ASSERT_EQ(report["collisions"].size(), 6U);
  const auto& first = report["collisions"][0];
  EXPECT_EQ(first["kind"], "clearance");
  EXPECT_EQ(first["pair"][0], "Table1");
  EXPECT_EQ(first["depth"], 0.0);
  const auto& last = report["collisions"][5];
  EXPECT_EQ(last["kind"], "clearance_restored");
  EXPECT_NEAR(last["depth"].get<double>(), 0.003, 1e-4);
  EXPECT_NEAR(last["position"]["z"].get<double>(), 0.7 - 0.0015, 1e-4);
}

}  // namespace
}  // namespace takt
