// The thesis' industrial cells from start to end (sections 5.4 and 5.5), at their intended levels of detail:
// all assertions of the scenario files hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/geometry/convex/decomposition.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/device_report.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

struct CellRun {
  HeadlessResult result;
  CellDescription cell;
  std::vector<std::array<double, 3>> history;  ///< time and two signals
};

struct Watched {
  std::string device, first, second;
};

using Look = std::function<void(const CellDescription&, const Snapshot&)>;

CellRun run_cell(const std::string& name, const ScenarioOptions& options, const Watched& watched = {},
                 bool demands = true, const Look& look = {}) {
  const Scenario scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / (name + ".yaml"), options);
  Simulation simulation(build_cell(scenario, {user_cache_directory(), nullptr}));
  CellRun done;
  done.cell = simulation.description();
  Snapshot snapshot = simulation.make_snapshot();
  HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  headless.contact_extremes = scenario.begins_with_contact();
  const auto observer = [&](const Simulation& s) {
    if (look && s.step_index() % 4 == 0) {
      s.read_snapshot(snapshot);
      look(done.cell, snapshot);
    }
    if (watched.device.empty() || s.step_index() % 200 != 0) return;
    s.read_snapshot(snapshot);
    done.history.push_back({s.time_s(),
                            signal_value(done.cell, snapshot, watched.device, watched.first).value(),
                            signal_value(done.cell, snapshot, watched.device, watched.second).value()});
  };
  done.result = run_headless(simulation, scenario, headless, observer);
  EXPECT_EQ(done.result.fault, "");
  if (!demands) return done;
  for (const AssertionResult& demand : done.result.assertions)
    EXPECT_NE(demand.verdict, AssertionResult::Verdict::failed) << demand.name << ": " << demand.sentence;
  for (const ExpectedPose& expected : scenario.expected) {
    const auto part = static_cast<std::size_t>(done.cell.find_component(expected.part));
    EXPECT_LT(pose_error(done.result.final_state.components[part], expected.X_WB).position_m,
              scenario.expected_tolerance_m)
        << expected.part;
  }
  return done;
}

const ContactExtreme* largest(const CellRun& done, const std::string& a, const std::string& b) {
  for (const ContactExtreme& most : done.result.contact_extremes) {
    const std::string& base = done.cell.components[static_cast<std::size_t>(most.sample.base)].name;
    const std::string& target = done.cell.components[static_cast<std::size_t>(most.sample.target)].name;
    if ((base == a && target == b) || (base == b && target == a)) return &most;
  }
  return nullptr;
}

TEST(FurnaceScenario, TheRotorIsHeatedInTheFurnace) {
  const CellRun done = run_cell("furnace", {}, {"Furnace", "power", "air_temperature"});
  double first = 0.0, second = 0.0, coldest = 300.0;
  for (const auto& [t, power, air] : done.history) {
    if (t > 1000.0 && t < 1200.0) first = std::max(first, power);
    if (t > 8200.0 && t < 8400.0) second = std::max(second, power);
    coldest = std::min(coldest, air);
  }
  EXPECT_NEAR(first, 2080.0, 1.0);
  EXPECT_NEAR(second, 1767.0, 2.0);
  EXPECT_LT(coldest, 60.0);  // one second after the door
  const auto temperature = signal_value(done.cell, done.result.final_state, "Rotor_heat", "temperature");
  EXPECT_NEAR(temperature.value(), 281.05, 0.1);
}

/// Its box and its motor are convex parts by V-HACD.
class ChainsawScenario : public testing::Test {
 protected:
  void SetUp() override {
    if (!decomposition_available()) GTEST_SKIP() << "built without V-HACD";
  }
};

TEST_F(ChainsawScenario, TheMotorReachesItsSeatByKinematicsAndByDynamics) {
  for (const int level : {1, 2}) {
    ScenarioOptions options;
    options.level_of_detail = level;
    const CellRun done = run_cell("chainsaw_motor", options);
    const auto skipped =
        std::count_if(done.result.assertions.begin(), done.result.assertions.end(),
                      [](const auto& demand) { return demand.verdict == AssertionResult::Verdict::skipped; });
    EXPECT_EQ(skipped, 1) << level;  // the contact force
  }
}

/// The shipped scenario by surface contact.
const CellRun& pressed_in() {
  static const CellRun done = [] {
    ScenarioOptions options;
    options.level_of_detail = 3;
    return run_cell("chainsaw_motor", options);
  }();
  return done;
}

TEST_F(ChainsawScenario, ThePressFitShowsItsForceWithSurfaceContact) {
  const CellRun& done = pressed_in();
  const ContactExtreme* press = largest(done, "Motor", "Housing");
  ASSERT_NE(press, nullptr);
  EXPECT_GT(press->time_s, 22.5);  // while it is pressed in; thesis: 23.8 s
  EXPECT_LT(press->time_s, 24.9);
}

// The robot is position-controlled and stops hold the housing: its offset from the seat becomes a force.
TEST_F(ChainsawScenario, ThePressForceGrowsWithTheLateralOffsetOfTheRobot) {
  const ContactExtreme* centred = largest(pressed_in(), "Motor", "Housing");
  ASSERT_NE(centred, nullptr);
  double before = centred->sample.result.normal_force_N;
  for (const char* offset : {"0.0005", "0.001"}) {
    ScenarioOptions options;
    options.level_of_detail = 3;
    options.overrides = {"duration_s=24.8", std::string("controller.parameters.lateral_offset_m=") + offset};
    const CellRun done = run_cell("chainsaw_motor", options, {}, false);
    const ContactExtreme* press = largest(done, "Motor", "Housing");
    ASSERT_NE(press, nullptr);
    EXPECT_GT(press->time_s, 22.5) << offset;
    EXPECT_GT(press->sample.result.normal_force_N, 1.05 * before) << offset;
    before = press->sample.result.normal_force_N;
  }
}

// The nest's friction follows mu N g(v / v_e), g(s) = s (2 - s): it carries the box from the speed on at
// which it is the box's weight.
TEST_F(ChainsawScenario, TheBoxStaysUnderASlowMotorAndIsLiftedByAFastOne) {
  const auto highest = [](const char* lift_speed) {
    ScenarioOptions options;
    options.level_of_detail = 3;
    options.overrides = {"duration_s=9",
                         std::string("controller.parameters.lift_speed_m_per_s=") + lift_speed};
    double z = 0.0;
    const CellRun done = run_cell(
        "chainsaw_motor", options, {}, false, [&z](const CellDescription& cell, const Snapshot& now) {
          z = std::max(z, now.components[static_cast<std::size_t>(cell.find_component("Box"))].p_WB.z());
        });
    const auto motor = static_cast<std::size_t>(done.cell.find_component("Motor"));
    EXPECT_GT(done.result.final_state.components[motor].p_WB.z(), 0.72) << lift_speed;  // it is out
    return z - 0.7;
  };
  EXPECT_LT(highest("0.02"), 1e-4);
  EXPECT_GT(highest("0.15"), 5e-3);
}

TEST(RotorScenario, AllSubstituteForcesKeepTheTimetable) {
  ScenarioOptions options;
  options.level_of_detail = 1;
  const CellRun done = run_cell("bev_rotor", options, {"Furnace1", "power", "parts_inside"});
  for (const auto& [t, power, inside] : done.history) {
    if (t > 36.0) {
      EXPECT_EQ(inside, 1.0) << t;
    }
    if (t < 30.0) {
      EXPECT_NEAR(power, 658.56, 1e-3) << t;
    }
  }
}

TEST(RotorScenario, AllDynamicKeepTheTimetable) {
  ScenarioOptions options;
  options.level_of_detail = 2;
  const CellRun done = run_cell("bev_rotor", options, {"Screwdriver", "torque", "engaged"});
  const auto turned = signal_value(done.cell, done.result.final_state, "Screw2_thread", "turns");
  EXPECT_NEAR(turned.value(), 12.5, 1e-9);  // 12.5 mm at 1 mm
  const auto skipped =
      std::count_if(done.result.assertions.begin(), done.result.assertions.end(),
                    [](const auto& demand) { return demand.verdict == AssertionResult::Verdict::skipped; });
  EXPECT_EQ(skipped, 2);  // contact forces
}

TEST(RotorScenario, AllBySurfaceContactKeepTheTimetable) {
  ScenarioOptions options;
  options.level_of_detail = 3;
  const CellRun done = run_cell("bev_rotor", options);
  for (const AssertionResult& demand : done.result.assertions)
    EXPECT_EQ(demand.verdict, AssertionResult::Verdict::passed) << demand.name << ": " << demand.sentence;
  EXPECT_NE(largest(done, "Core2", "Gripper1/left_jaw"), nullptr);
}

TEST(RotorScenario, ScrewsContinueWithTheSameBitsFromASavedState) {
  ScenarioOptions options;
  options.level_of_detail = 3;
  const Scenario scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "bev_rotor.yaml", options);
  const auto cell = build_cell(scenario, {user_cache_directory(), nullptr});
  Simulation simulation(cell), other(cell);
  const auto go_on = [](Simulation& s) {
    for (int i = 0; i < 25; ++i) ASSERT_TRUE(s.step({})) << s.fault();
  };
  go_on(simulation);
  std::vector<std::byte> bytes;
  ASSERT_EQ(simulation.save_state(bytes), "");
  go_on(simulation);
  ASSERT_EQ(other.restore_state(bytes), "");
  go_on(other);
  EXPECT_EQ(other.state_hash(), simulation.state_hash());
}

TEST(RotorScenario, TheHybridRunPressesTheMagnetOut) {
  const CellRun done = run_cell("bev_rotor", {});
  const ContactExtreme* tray = largest(done, "Magnet4", "Tray");
  ASSERT_NE(tray, nullptr);
  EXPECT_GT(tray->time_s, 69.0);
  EXPECT_LT(tray->time_s, 73.0);                           // falling, or still rolling there
  EXPECT_EQ(largest(done, "Core2", "Furnace1"), nullptr);  // contact in the press alone
  const auto energies = consumed_energies(done.cell, done.result.final_state);
  EXPECT_EQ(
      std::count_if(energies.begin(), energies.end(), [](const auto& e) { return e.consumer == "Robot2"; }),
      0);  // kinematic
  EXPECT_EQ(
      std::count_if(energies.begin(), energies.end(), [](const auto& e) { return e.consumer == "Robot1"; }),
      1);
}

TEST(RotorScenario, TheAdhesiveHoldsAColdMagnet) {
  ScenarioOptions options;
  options.overrides = {"parts.Core4.heat.temperature_degC=20"};
  const CellRun done = run_cell("bev_rotor", options, {}, false);
  EXPECT_EQ(largest(done, "Magnet4", "Tray"), nullptr);
  const auto magnet = static_cast<std::size_t>(done.cell.find_component("Magnet4"));
  // Where the core holds it, 5 mm above its lower face; the press has pushed with all it has.
  EXPECT_NEAR(done.result.final_state.components[magnet].p_WB.z(), 0.604, 0.003);
}

}  // namespace
}  // namespace takt
