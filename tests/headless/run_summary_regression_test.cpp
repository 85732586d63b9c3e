// The summary of a run: the same numbers for a person and in the report, in columns apart.
#include "server/headless/run_summary.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "server/headless/report.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/child_process.h"

namespace takt {
namespace {

using Json = nlohmann::ordered_json;
using ::testing::HasSubstr;
using ::testing::Not;

struct Summarised {
  Json report;
  std::string words;
};

Summarised run(const std::string& scenario_file, ScenarioOptions options, double duration_s) {
  const Scenario scenario = read_scenario(TAKT_CONFIG_DIR "/scenarios/" + scenario_file, options);
  const auto cell = build_cell(scenario);
  Simulation simulation(cell);
  HeadlessOptions headless;
  headless.duration_s = duration_s;
  headless.program = scenario.controller_program;
  headless.run_metrics = true;
  const HeadlessResult result = run_headless(simulation, scenario, headless);
  const RunInfo info{scenario.initial_solver(), cell->description.level_of_detail, Pace::free, {}, {}};
  std::ostringstream words;
  print_summary(words, scenario, cell->description, result);
  return {Json::parse(report_json(scenario, cell->description, info, result)), words.str()};
}

TEST(RunSummary, ASlidingSlabEndsWhereFrictionHasTakenItsEnergy) {
  const Summarised done = run("contact/sliding_block.yaml", {}, 0.6);
  const Json& part = done.report["summary"]["parts"].at(0);
  EXPECT_EQ(part["name"], "Slab");
  EXPECT_EQ(part["held_by"], "Plate");
  EXPECT_NEAR(part["position"]["x"].get<double>(), -0.2 + 1.0 / (2.0 * 0.3 * 9.80665), 0.0005);
  const Json& force = done.report["summary"]["largest_contact_force"];
  EXPECT_NEAR(force["normal_force"].get<double>(), 0.2 * 9.80665, 0.02);
  EXPECT_TRUE(done.report["summary"]["cycle_time"].is_null());
  EXPECT_THAT(done.words, HasSubstr("Largest contact force 1.97"));
  EXPECT_THAT(done.words,
              HasSubstr("\nPart      x (m)     y (m)     z (m)  error (mm)  held by\nSlab  -0.03"));
  EXPECT_THAT(done.words, HasSubstr("No event of severity warning or error\n"));
  EXPECT_THAT(done.words, Not(HasSubstr("largest load")));  // no robot, no gripper
}

TEST(RunSummary, RobotsAndGrippersHaveTheirLargestLoads) {
  ScenarioOptions options;
  options.level_of_detail = 2;
  const Summarised done = run("block_assembly.yaml", options, 8.0);
  const Json& margins = done.report["run_metrics"]["margins"];
  std::size_t robots = 0, grippers = 0;
  for (const Json& load : done.report["summary"]["loads"]) {
    const std::string of = load["of"];
    if (!of.starts_with("Robot")) {
      EXPECT_TRUE(of.starts_with("Gripper"));
      ++grippers;
      continue;
    }
    ++robots;
    // Of all torques of this robot the one nearest to its limit.
    double most = 0.0;
    for (const Json& margin : margins) {
      const std::string name = margin["of"];
      if (name.starts_with(of.substr(0, 6)) && name.ends_with(" torque"))
        most = std::max(most, margin["use"].get<double>());
    }
    EXPECT_EQ(load["use"].get<double>(), most) << of;
  }
  EXPECT_EQ(robots, 2U);
  EXPECT_EQ(grippers, 2U);
  EXPECT_THAT(done.words, HasSubstr("\nlargest load  "));
  // The program takes 41 s: what it has done after 8 s is no cycle, and Parts on their way are far from their places.
  EXPECT_TRUE(done.report["summary"]["cycle_time"].is_null());
  EXPECT_TRUE(done.report["run_metrics"]["cycle_time"].is_null());
  EXPECT_THAT(done.words, HasSubstr("\nNo cycle time: the program goes on at the end of the run"));
  EXPECT_THAT(done.words, testing::ContainsRegex("\nB .* [0-9]{4}  Table1"));
}

TEST(RunSummary, AProgramThatEndsHasTheCycleTimeOfItsLastStep) {
  const Summarised done = run("block_assembly.yaml", {}, 42.0);
  const Json& metrics = done.report["run_metrics"];
  double last_s = 0.0;
  for (const Json& step : metrics["steps"]) last_s = std::max(last_s, step["end"].get<double>());
  EXPECT_GT(last_s, 40.0);
  EXPECT_LT(last_s, 42.0);
  EXPECT_EQ(metrics["cycle_time"].get<double>(), last_s);
  EXPECT_THAT(done.words, HasSubstr("\nCycle time 41.2"));
  // Every limit has a unit, and no sentence the digits of rounding errors.
  for (const Json& margin : metrics["margins"]) EXPECT_NE(margin["unit"], "") << margin.dump();
  for (const auto& [name, demand] : done.report["assertions"].items())
    EXPECT_THAT(demand["sentence"].get<std::string>(), Not(HasSubstr("e-"))) << name;
}

TEST(RunSummary, TheFaultThatEndsARunIsAmongTheWarnings) {
  ScenarioOptions options;
  options.overrides = {"parts.Box.pose.position_m=[-3, 0, 0.05]",  // beside the plate
                       "world.bounds_m={lower: [-4, -1, -0.5], upper: [1, 1, 2]}"};
  const Summarised done = run("contact/drop.yaml", options, 2.0);
  const Json& warnings = done.report["warnings"];
  ASSERT_FALSE(warnings.empty());
  EXPECT_EQ(warnings.back()["severity"], "error");
  EXPECT_EQ(warnings.back()["code"], "simulation_fault");
  EXPECT_THAT(warnings.back()["message"].get<std::string>(),
              HasSubstr(done.report["fault"].get<std::string>()));
  EXPECT_THAT(done.words, HasSubstr("has left the world"));
}

TEST(RunSummary, WarningsAreThoseOfTheServersEvents) {
  const Summarised done = run("weak_grip.yaml", {}, 9.0);
  const Json& warnings = done.report["warnings"];
  ASSERT_FALSE(warnings.empty());
  EXPECT_EQ(warnings[0]["code"], "weak_grip");
  EXPECT_EQ(warnings[0]["severity"], "warning");
  EXPECT_THAT(done.words, HasSubstr("\n1 event of severity warning or error:\n"));
  EXPECT_THAT(done.words, HasSubstr(warnings[0]["message"].get<std::string>()));
}

}  // namespace
}  // namespace takt
