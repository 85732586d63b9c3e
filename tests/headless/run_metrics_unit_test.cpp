// Metrics of a run against independent computations; two reports compared; the page for a browser.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "server/headless/comparison.h"
#include "server/headless/headless_run.h"
#include "server/headless/html_report.h"
#include "server/headless/report.h"
#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

using Json = nlohmann::ordered_json;
using ::testing::HasSubstr;

struct ReportedRun {
  Json report;
  std::string page;
  /// By an observer of its own, after every step: of Robot2's second joint.
  double largest_speed = 0.0, largest_torque = 0.0;
  std::map<double, double> energy_J;  ///< of Robot2 at some times
};

ReportedRun run(int level, std::vector<std::string> overrides = {}, double duration_s = 12.0) {
  ScenarioOptions options;
  options.level_of_detail = level;
  options.overrides = std::move(overrides);
  const Scenario scenario =
      read_scenario(std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", options);
  Simulation simulation(build_cell(scenario));
  HeadlessOptions headless;
  headless.duration_s = duration_s;
  headless.program = scenario.controller_program;
  headless.run_metrics = true;
  ReportedRun done;
  Snapshot snapshot = simulation.make_snapshot();
  const HeadlessResult result = run_headless(simulation, scenario, headless, [&](const Simulation& s) {
    s.read_snapshot(snapshot);
    const RobotSample& robot = snapshot.robots[1];
    done.largest_speed = std::max(done.largest_speed, std::abs(robot.velocity[1]));
    done.largest_torque = std::max(done.largest_torque, std::abs(robot.effort[1]));
    if (s.step_index() % 8 == 0) done.energy_J[snapshot.time_s] = robot.power.electrical_energy_J;
  });
  EXPECT_EQ(result.fault, "");
  const RunInfo info{scenario.initial_solver(), level, Pace::free, {}, {}};
  done.report = Json::parse(report_json(scenario, simulation.description(), info, result));
  std::ostringstream page;
  write_html(page, scenario, simulation.description(), info, result);
  done.page = page.str();
  return done;
}

const ReportedRun& kinematic() {
  static const ReportedRun done = run(1);
  return done;
}
const ReportedRun& dynamic() {
  static const ReportedRun done = run(2);
  return done;
}

TEST(RunMetrics, LargestLoadsEqualThoseOfAnObserver) {
  const Json& joint = dynamic().report["run_metrics"]["robots"]["Robot2"]["joints"]["shoulder_lift_joint"];
  EXPECT_EQ(joint["largest_speed"].get<double>(), dynamic().largest_speed);
  EXPECT_EQ(joint["largest_effort"].get<double>(), dynamic().largest_torque);
  EXPECT_GT(dynamic().largest_torque, 10.0);
  // Kinematic robots are evaluated every 10 ms and have no torques.
  const Json& slower = kinematic().report["run_metrics"]["robots"]["Robot2"]["joints"]["shoulder_lift_joint"];
  EXPECT_NEAR(slower["largest_speed"].get<double>(), kinematic().largest_speed, 0.01);
  EXPECT_FALSE(slower.contains("largest_effort"));
}

TEST(RunMetrics, MarginsAreSharesOfTheLimitsOfTheUrdf) {
  const Json& margins = dynamic().report["run_metrics"]["margins"];
  const auto of = [&](const std::string& name) {
    const auto found =
        std::find_if(margins.begin(), margins.end(), [&](const Json& m) { return m["of"] == name; });
    return found == margins.end() ? Json() : *found;
  };
  const Json torque = of("Robot2.shoulder_lift_joint torque");
  ASSERT_TRUE(torque.is_object());
  EXPECT_EQ(torque["limit"].get<double>(), 330.0);
  EXPECT_DOUBLE_EQ(torque["use"].get<double>(), dynamic().largest_torque / 330.0);
  for (std::size_t i = 1; i < margins.size(); ++i)
    EXPECT_GE(margins[i - 1]["use"].get<double>(), margins[i]["use"].get<double>());
}

TEST(RunMetrics, StepsHaveTheirTimesAndTheirEnergy) {
  int of_robot2 = 0;
  double sum_J = 0.0;
  for (const Json& step : dynamic().report["run_metrics"]["steps"]) {
    EXPECT_TRUE(step["named"].get<bool>());
    if (step["robot"] != "Robot2") continue;
    ++of_robot2;
    const double begin_s = step["begin"], end_s = step["end"];
    const double energy_J = step["electrical_energy"]["Robot2"];
    sum_J += energy_J;
    const auto at = [&](double t) { return std::prev(dynamic().energy_J.upper_bound(t + 1e-6))->second; };
    EXPECT_NEAR(energy_J, at(end_s) - at(begin_s), 0.05) << step["name"];  // 10 ms at some 100 W are 1 J
  }
  EXPECT_EQ(of_robot2, 1);  // C into B, until the end of these 12 s
  EXPECT_NEAR(sum_J, dynamic().report["power"]["consumers"]["Robot2"]["electrical_energy"].get<double>(),
              1e-9);
}

TEST(RunMetrics, AProgramWithoutStepsIsReportedByItsCalls) {
  const ReportedRun done =
      run(1, {"controller.program=" TAKT_CONFIG_DIR "/programs/block_disassembly.lua"}, 0.5);
  const Json& steps = done.report["run_metrics"]["steps"];
  ASSERT_FALSE(steps.empty());
  for (const Json& step : steps) {
    EXPECT_FALSE(step["named"].get<bool>());
    EXPECT_GT(step["line"].get<int>(), 0);
    EXPECT_LE(step["end"].get<double>(), 0.5 + 1e-9);
  }
}

TEST(RunMetrics, ThePageIsSelfContained) {
  for (std::string page : {kinematic().page, dynamic().page}) {
    // The picture of the cell is in the page.
    const std::string image =
        " src=\"data:image/png;base64,iVBORw0KGgo";  // the eight bytes that begin each PNG file
    const std::size_t picture = page.find(image);
    ASSERT_NE(picture, std::string::npos);
    page.erase(picture, image.size());
    EXPECT_THAT(page, HasSubstr("C into B"));
    EXPECT_THAT(page, HasSubstr("<svg"));
    for (const char* outside : {"src=", "href=", "url(", "@import", "<script", "<link"})
      EXPECT_EQ(page.find(outside), std::string::npos) << outside;
    std::size_t opened = 0, closed = 0;
    for (std::size_t at = page.find("<table"); at != std::string::npos; at = page.find("<table", at + 1))
      ++opened;
    for (std::size_t at = page.find("</table"); at != std::string::npos; at = page.find("</table", at + 1))
      ++closed;
    EXPECT_EQ(opened, closed);
  }
  EXPECT_THAT(dynamic().page, HasSubstr("Torques of Robot1"));
  EXPECT_THAT(kinematic().page, HasSubstr("Joint speeds of Robot1"));
}

TEST(RunMetrics, ThePageBeginsWithTheVerdict) {
  const std::string& page = dynamic().page;
  const std::size_t heading = page.find("</h1>"), verdict = page.find("<div class=\"verdict passed\">");
  ASSERT_NE(verdict, std::string::npos);
  EXPECT_EQ(page.substr(heading + 5, verdict - heading - 5), "\n");
  EXPECT_LT(verdict, page.find("<img"));
  EXPECT_LT(page.find("<img"), page.find("<h2>"));
  // A demand that is not met is named there, and is the first of its table.
  Json report = dynamic().report;
  report["assertions"]["torque"] = {{"verdict", "passed"}, {"sentence", "70 N m"}, {"time", 1.0}};
  report["assertions"]["time"] = {{"verdict", "failed"}, {"sentence", "12 s; allowed: 10 s"}, {"time", 10.0}};
  std::ostringstream failing;
  write_html_report(failing, report, {}, "");
  EXPECT_THAT(failing.str(),
              HasSubstr("</h1>\n<div class=\"verdict failed\"><strong>failed</strong><span>1 demand "
                        "is not met: time; 1 demand is met.</span>"));
  EXPECT_LT(failing.str().find("allowed: 10 s"), failing.str().find("70 N m"));
}

TEST(Comparison, ARunDoesNotDifferFromItself) {
  const Comparison same = compare_reports(dynamic().report, dynamic().report, {});
  EXPECT_TRUE(same.enough);
  EXPECT_TRUE(same.contradictions.empty());
  EXPECT_FALSE(same.differences.empty());
  for (const Difference& d : same.differences) EXPECT_NEAR(d.difference, 0.0, 1e-7) << d.of;
  EXPECT_EQ(same.verdict, "Nothing that counts differs");
}

TEST(Comparison, TheLowerLevelIsEnoughWhileTheHigherOneAddsNothing) {
  const Comparison enough = compare_reports(kinematic().report, dynamic().report, {});
  EXPECT_TRUE(enough.enough) << enough.verdict;
  EXPECT_THAT(enough.verdict, HasSubstr("LoD 1 is enough here"));
  // The same with a torque limit that the run uses up: only level 2 can evaluate it.
  ComparisonLimits strict;
  set_limit(strict, "use=0.05");
  const Comparison missing = compare_reports(kinematic().report, dynamic().report, strict);
  EXPECT_FALSE(missing.enough);
  EXPECT_THAT(missing.verdict, HasSubstr("LoD 1 is not enough here"));
  EXPECT_TRUE(missing.differences.front().counts());
  EXPECT_THAT(missing.differences.front().of, HasSubstr("torque"));
}

TEST(Comparison, DifferencesAreListedTheLargestFirst) {
  Json changed = dynamic().report;
  double& energy = *changed["run_metrics"]["consumers"]["Robot1"]["electrical_energy"].get_ptr<double*>();
  energy *= 1.2;
  *changed["components"]["C"]["position"]["z"].get_ptr<double*>() += 0.01;
  changed["connection_changes"].back()["to"] = "Table2";
  Comparison found = compare_reports(dynamic().report, changed, {});
  ASSERT_GE(found.differences.size(), 2U);
  EXPECT_EQ(found.differences[0].of, "place of C at the end");  // ten times the limit
  EXPECT_NEAR(found.differences[0].difference, 0.01, 1e-9);
  EXPECT_EQ(found.differences[1].of, "energy of Robot1");  // a sixth, 5 % allowed
  EXPECT_NEAR(found.differences[1].difference, 1.0 / 6.0, 1e-9);
  ASSERT_EQ(found.contradictions.size(), 1U);
  EXPECT_THAT(found.contradictions[0], HasSubstr("Table2"));
  EXPECT_THAT(found.verdict, HasSubstr("3 differences count"));
  changed["fault"] = "it diverged";
  found = compare_reports(dynamic().report, changed, {});
  EXPECT_THAT(found.contradictions[0], HasSubstr("it diverged"));
}

TEST(Comparison, AssertionsUndecidedInOneRunMustHoldInTheOther) {
  Json one = kinematic().report, other = dynamic().report;
  one["assertions"]["force"] = {{"verdict", "skipped"}, {"sentence", "nothing to judge by"}};
  other["assertions"]["force"] = {{"verdict", "passed"}, {"sentence", "20 N"}};
  EXPECT_TRUE(compare_reports(one, other, {}).enough);
  other["assertions"]["force"]["verdict"] = "failed";
  EXPECT_FALSE(compare_reports(one, other, {}).enough);
}

TEST(Comparison, InvalidLimitsAndForeignReportsAreRefused) {
  ComparisonLimits limits;
  for (const char* wrong : {"", "energy", "energy=", "energy=-1", "energy=x", "speed=1", "energy=1 "})
    EXPECT_ANY_THROW(set_limit(limits, wrong)) << wrong;
  Json other = kinematic().report;
  other["scenario"] = "another";
  EXPECT_ANY_THROW(compare_reports(kinematic().report, other, {}));
  std::ostringstream out;
  EXPECT_ANY_THROW(compare_files(out, TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml", "none", "", limits));
}

}  // namespace
}  // namespace takt
