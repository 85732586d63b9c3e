// Assertions of scenarios about runs: verdicts, their times, JUnit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "server/headless/assertions.h"
#include "server/headless/report.h"
#include "server/scenario/scenario_reader.h"
#include "tests/support/box_cell.h"
#include "tests/support/test_device.h"

namespace takt {
namespace {

using ::testing::HasSubstr;
using Kind = ScenarioAssertion::Kind;
using Verdict = AssertionResult::Verdict;

/// A box of 1 kg that falls from 0.5 m onto a ground, and a chamber that stays at 20 C.
class Assertions : public ::testing::Test {
 protected:
  Assertions() {
    cell_.ground("Table", {1.0, 1.0, 0.1}, test::at(0.0, 0.0, -0.1));
    cell_.part("Box", 1.0, 1, {0.1, 0.1, 0.1}, test::at(0.0, 0.0, 0.5));
    test::add_chamber(cell_.model());
    scenario_.assertions.reserve(8);  // references returned by demand() stay valid
  }
  ScenarioAssertion& demand(Kind kind, const std::string& subject, double time_s = -1.0) {
    ScenarioAssertion& added = scenario_.assertions.emplace_back();
    added.kind = kind;
    added.name = "demand " + std::to_string(scenario_.assertions.size());
    added.subject = subject;
    added.time_s = time_s;
    return added;
  }
  std::vector<AssertionResult> run(double until_s) {
    Simulation simulation(cell_.build());
    AssertionChecker checker(scenario_, simulation);
    checker.note(simulation);
    std::string fault;
    while (simulation.time_s() < until_s - 1e-9) {
      if (!simulation.step({})) break;
      checker.note(simulation);
    }
    return checker.finish(simulation, simulation.fault());
  }
  test::BoxCell cell_;
  Scenario scenario_;
};

TEST_F(Assertions, PosesAreJudgedAtTheirTime) {
  ScenarioAssertion& falls = demand(Kind::pose, "Box", 0.2);
  falls.X_WB = test::at(0.0, 0.0, 0.5 - 0.5 * 9.80665 * 0.04);
  falls.tolerance_m = 0.001;
  ScenarioAssertion& stays = demand(Kind::pose, "Box", 0.2);
  stays.X_WB = test::at(0.0, 0.0, 0.5);
  stays.tolerance_m = 0.001;
  ScenarioAssertion& never = demand(Kind::pose, "Box", 5.0);
  never.X_WB = falls.X_WB;
  never.tolerance_m = 10.0;
  const auto results = run(0.3);
  EXPECT_EQ(results[0].verdict, Verdict::passed);
  EXPECT_NEAR(results[0].time_s, 0.2, 1e-9);
  EXPECT_EQ(results[1].verdict, Verdict::failed);
  EXPECT_THAT(results[1].sentence, HasSubstr("Box is 196.1"));
  EXPECT_EQ(results[2].verdict, Verdict::failed);
  EXPECT_THAT(results[2].sentence, HasSubstr("the run ended at 0.3 s, before 5 s"));
}

TEST_F(Assertions, HoldersAndSignalsAreJudgedOrReportedAsUndecided) {
  demand(Kind::held_by, "Box", 0.0).holder = "";
  demand(Kind::held_by, "Box").holder = "Table";
  ScenarioAssertion& warm = demand(Kind::signal, "Chamber");
  warm.signal = "temperature";
  warm.lower = 19.0;
  warm.upper = 21.0;
  ScenarioAssertion& hot = demand(Kind::signal, "Chamber");
  hot.signal = "temperature";
  hot.lower = 100.0;
  ScenarioAssertion& pressed = demand(Kind::contact_force, "");
  pressed.pair = {"Box", "Tab*"};
  pressed.upper = 1.0;
  demand(Kind::no_collision, "");
  const auto results = run(2.0);
  const Verdict expected[] = {Verdict::passed, Verdict::passed,  Verdict::passed,
                              Verdict::failed, Verdict::skipped, Verdict::passed};
  for (std::size_t i = 0; i < results.size(); ++i)
    EXPECT_EQ(results[i].verdict, expected[i]) << i << ": " << results[i].sentence;
  EXPECT_THAT(results[3].sentence, HasSubstr("temperature is 20 C; allowed: at least 100 C"));
}

TEST_F(Assertions, ExpectedPlacesAreDemandsOfARunThatReachesItsDuration) {
  scenario_.duration_s = 0.2;
  scenario_.expected_tolerance_m = 0.002;
  scenario_.expected = {{"Box", test::at(0.0, 0.0, 0.5 - 0.5 * 9.80665 * 0.04)}};
  const auto judged = [&](double duration_s) {
    Simulation simulation(cell_.build());
    HeadlessOptions options;
    options.duration_s = duration_s;
    return run_headless(simulation, scenario_, options);
  };
  const HeadlessResult there = judged(0.2);
  ASSERT_EQ(there.assertions.size(), 1U);
  EXPECT_EQ(there.assertions[0].verdict, Verdict::passed) << there.assertions[0].sentence;
  EXPECT_EQ(verdict(there), "passed");
  // Another 0.05 s of fall are 110 mm.
  const HeadlessResult beyond = judged(0.25);
  ASSERT_EQ(beyond.assertions.size(), 1U);
  EXPECT_EQ(beyond.assertions[0].verdict, Verdict::failed);
  EXPECT_NEAR(*beyond.assertions[0].value, 0.5 * 9.80665 * (0.0625 - 0.04), 0.002);
  EXPECT_EQ(verdict(beyond), "failed");
  EXPECT_TRUE(judged(0.1).assertions.empty()) << "the Box is on its way";
}

TEST_F(Assertions, UnknownNamesAreReported) {
  demand(Kind::signal, "Chamber").signal = "colour";
  try {
    run(0.1);
    FAIL();
  } catch (const ScenarioError& error) {
    EXPECT_THAT(error.what(), HasSubstr("found 'colour'; allowed: set_point, lamp, temperature"));
  }
  scenario_.assertions.clear();
  demand(Kind::contact_force, "").pair = {"Bax", "Table"};
  EXPECT_THROW(run(0.1), ScenarioError);
}

TEST(Junit, TheFileHasACaseForTheRunAndForEachAssertion) {
  std::ostringstream out;
  write_junit(out, "cell", 1.5, "it <stopped>",
              {{"a & b", "pose", Verdict::passed, "fine", 1.0},
               {"c", "energy", Verdict::failed, "\"much\"", 2.0},
               {"d", "contact_force", Verdict::skipped, "none", 3.0}});
  const std::string text = out.str();
  EXPECT_THAT(text, HasSubstr("tests=\"4\" failures=\"1\" errors=\"1\" skipped=\"1\""));
  EXPECT_THAT(text, HasSubstr("<error message=\"it &lt;stopped&gt;\"/>"));
  EXPECT_THAT(text, HasSubstr("name=\"a &amp; b\""));
  EXPECT_THAT(text, HasSubstr("<failure type=\"energy\" message=\"&quot;much&quot;\"/>"));
  EXPECT_THAT(text, HasSubstr("<skipped message=\"none\"/>"));
}

}  // namespace
}  // namespace takt
