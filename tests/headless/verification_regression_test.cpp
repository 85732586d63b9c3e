// The verification report end to end, on a scene with a closed form.
#include "server/headless/verification.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "idl/common/text.h"
#include "server/headless/verification_report.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::HasSubstr;

constexpr double kAngle = 1.292115653224914;  // of the pendulum after 10 s, closed form

class VerificationReport : public testing::Test {
 protected:
  Verification run(const std::string& scenes) {
    const std::filesystem::path file = directory_.path() / "plan.yaml";
    std::ofstream(file) << "takt_verification: 1\nname: test\nscenes:\n" << scenes;
    return verify(read_verification_plan(file), options());
  }
  static VerificationOptions options() {
    VerificationOptions options;
    options.version = "takt of the test";
    options.digest = [](const std::filesystem::path& of) { return "digest of " + of.filename().string(); };
    return options;
  }
  std::string scene(double reference, const std::string& more = "") const {
    std::ostringstream text;
    text.precision(17);
    text << "  pendulum:\n    scenario: " << TAKT_CONFIG_DIR << "/verification/pendulum.yaml\n"
         << "    quantity: robots.Pendulum.position.bearing\n    unit: rad\n"
         << "    reference: {value: " << reference << ", exact: true, source: closed form}\n"
         << "    resolutions: {step: {key: solver.step_s, values: ['0.01', '0.005', '0.0025'], formal_order: "
            "4}}\n"
         << more;
    return text.str();
  }
  std::string refusal(const std::string& scenes) {
    try {
      run(scenes);
    } catch (const ScenarioError& error) {
      return error.what();
    }
    return "no refusal";
  }

  test::TemporaryDirectory directory_;
};

TEST_F(VerificationReport, APendulumKeepsItsClosedFormWithTheOrderOfTheMethod) {
  const Verification done = run(scene(kAngle));
  ASSERT_EQ(done.scenes.size(), 1U);
  const VerifiedScene& s = done.scenes[0];
  const VerifiedResolution& step = s.resolutions.at(0);
  EXPECT_TRUE(done.good()) << step.code_sentence << "; " << step.solution_sentence << "; "
                           << s.comparison_sentence;
  ASSERT_EQ(step.runs.size(), 3U);
  ASSERT_TRUE(step.runs[0].error_order.has_value());
  EXPECT_NEAR(*step.runs[0].error_order, 4.0, 0.2);
  EXPECT_NEAR(step.convergence.extrapolated, kAngle, 0.1 * std::abs(s.error));
  EXPECT_LE(std::abs(s.error), 2.0 * s.u_num);
  EXPECT_EQ(s.files[0].digest, "digest of pendulum.yaml");
}

TEST_F(VerificationReport, AWrongReferenceIsABadVerdict) {
  const Verification done = run(scene(kAngle + 1e-3));
  EXPECT_FALSE(done.good());
  EXPECT_EQ(done.scenes[0].comparison, VerificationVerdict::bad);
  EXPECT_EQ(done.scenes[0].resolutions[0].solution, VerificationVerdict::good);
  EXPECT_NEAR(done.scenes[0].error, -1e-3, 1e-5);
}

TEST_F(VerificationReport, UncertainInputsAreCarriedToTheResult) {
  const Verification done = run(scene(
      kAngle, "    inputs: {damping: {key: world.temperature_degC, value: 20, standard_uncertainty: 1}}\n"));
  EXPECT_EQ(done.scenes[0].u_input, 0.0);  // the pendulum has no temperature
  const Verification armature = run(scene(
      kAngle,
      "    inputs: {rotor: {key: joint_torques.Bearing.armature_kg_m2, value: 0.01, standard_uncertainty: "
      "0.01}}\n"
      "    verdict: {coverage_factor: 3}\n"));
  const VerifiedScene& s = armature.scenes[0];
  ASSERT_EQ(s.inputs.size(), 1U);
  EXPECT_NEAR(s.inputs[0].below, kAngle, 1e-4);  // no armature
  EXPECT_GT(s.u_input, 1e-3);
  EXPECT_EQ(s.comparison, VerificationVerdict::good) << s.comparison_sentence;
}

TEST_F(VerificationReport, ASettingWithoutEffectIsNoSolution) {
  std::string text = scene(kAngle);
  text.replace(text.find("solver.step_s"), 13, "world.temperature_degC");
  const Verification done = run(text);
  EXPECT_EQ(done.scenes[0].resolutions[0].convergence.state, GridState::no_difference);
  EXPECT_EQ(done.scenes[0].resolutions[0].solution, VerificationVerdict::bad);
  EXPECT_FALSE(done.good());
}

TEST_F(VerificationReport, ResultsWithoutAnOrderAreGoodWithinATenthOfATolerance) {
  const auto incline = [](const std::string& tolerance) {
    return "  incline:\n    scenario: " + std::string(TAKT_CONFIG_DIR) +
           "/scenarios/contact/incline.yaml\n    quantity: components.Slides.position.x\n    unit: m\n"
           "    reference: {value: 0.224471954, source: Coulomb friction}\n"
           "    resolutions: {step: {key: solver.step_s, values: ['0.002', '0.001', '0.0005']}}\n"
           "    verdict: {tolerance: " +
           tolerance + "}\n";
  };
  const VerifiedScene wide = run(incline("0.0005")).scenes.at(0);
  EXPECT_NE(wide.resolutions.at(0).convergence.state, GridState::monotone);
  EXPECT_TRUE(wide.good()) << wide.resolutions[0].solution_sentence << "; " << wide.comparison_sentence;
  EXPECT_GT(wide.u_num, 0.0);
  const VerifiedScene narrow = run(incline("1e-8")).scenes.at(0);
  EXPECT_EQ(narrow.resolutions.at(0).solution, VerificationVerdict::bad);
  EXPECT_EQ(narrow.comparison, VerificationVerdict::bad);
}

TEST_F(VerificationReport, AMeasurementHasTheUncertaintyOfItsRows) {
  const std::filesystem::path table = directory_.path() / "angles.csv";
  std::ofstream(table) << "value,standard_uncertainty\n1.29,0.003\n1.30,0.003\n1.28,0.003\n";
  std::string text = scene(kAngle);
  const std::size_t at = text.find("{value:");
  text.replace(at, text.find('\n', at) - at, "{measurement: angles.csv, source: a protractor}");
  const VerifiedScene s = run(text).scenes.at(0);
  EXPECT_NEAR(*s.plan.reference.value, 1.29, 1e-12);
  EXPECT_NEAR(s.u_reference, std::hypot(0.003, 0.01 / std::sqrt(3.0)), 1e-12);
  EXPECT_EQ(s.resolutions.at(0).code, VerificationVerdict::not_demanded);
  EXPECT_EQ(s.comparison, VerificationVerdict::good) << s.comparison_sentence;
}

TEST_F(VerificationReport, ErrorsStatePlaceValueAndWhatIsAllowed) {
  std::string text = scene(kAngle);
  text.replace(text.find("position.bearing"), 16, "position.bering");
  EXPECT_THAT(refusal(text),
              testing::AllOf(HasSubstr("plan.yaml"), HasSubstr("bering"), HasSubstr("bearing")));
  text = scene(kAngle);
  text.replace(text.find("'0.01', "), 8, "");
  EXPECT_THAT(refusal(text), HasSubstr("a list of three values or more"));
  text = scene(kAngle);
  text.replace(text.find("source: closed form"), 19, "source: ''");
  EXPECT_THAT(refusal(text), HasSubstr("scenes.pendulum.reference.source: found ''; allowed: a text"));
  EXPECT_THAT(refusal(scene(kAngle, "    sceenario: x\n")), HasSubstr("sceenario"));
}

TEST_F(VerificationReport, ASceneWithAMissingFileIsNotRunAndTheOthersAre) {
  std::string missing = scene(kAngle);
  missing.replace(missing.find("pendulum:"), 9, "first:   ");
  missing += "    set: [\"robots.Pendulum.urdf=absent.urdf\"]\n";
  const std::filesystem::path file = directory_.path() / "plan.yaml";
  std::ofstream(file) << "takt_verification: 1\nname: test\npreparation: make absent\nscenes:\n"
                      << missing << scene(kAngle);
  const Verification done = verify(read_verification_plan(file), options());
  ASSERT_EQ(done.scenes.size(), 2U);
  EXPECT_FALSE(done.good());
  EXPECT_FALSE(done.scenes[0].run);
  EXPECT_FALSE(done.scenes[0].good());
  EXPECT_TRUE(done.scenes[1].good());
  const nlohmann::ordered_json report = verification_json(done);
  EXPECT_EQ(report["scenes"][0]["verdict"], "not run");
  EXPECT_EQ(report["scenes"][0]["comparison"]["error"], nullptr);
  std::ostringstream page, words;
  write_verification_page(page, report);
  EXPECT_THAT(page.str(), HasSubstr("1 of 2 scenes are good"));
  print_verification(words, done);
  for (const std::string& text : {page.str(), words.str()})
    EXPECT_THAT(text, testing::AllOf(HasSubstr("cannot be loaded: "), HasSubstr("absent.urdf"),
                                     HasSubstr("make absent")));
  EXPECT_THAT(words.str(), HasSubstr("NOT RUN  first: "));
}

TEST_F(VerificationReport, AFormulaKnowsTheInputs) {
  // A pendulum of length 1 m swings by small angles with sqrt(g / L): the angle after a whole period.
  const auto swing = [](const std::string& reference) {
    return "  swing:\n    scenario: " + std::string(TAKT_CONFIG_DIR) +
           "/verification/pendulum.yaml\n    duration_s: 1\n"
           "    set: [\"robots.Pendulum.initial_joints_deg=[89.9]\"]\n"
           "    quantity: robots.Pendulum.position.bearing\n    unit: rad\n    reference: {" +
           reference +
           ", source: small angles}\n"
           "    resolutions: {step: {key: solver.step_s, values: ['0.02', '0.01', '0.005']}}\n"
           "    inputs: {g: {key: 'world.gravity_m_per_s2[2]', value: -9.81, standard_uncertainty: 0.01}}\n"
           "    verdict: {tolerance: 1.0e-6}\n";
  };
  const VerifiedScene s =
      run(swing("formula: 'math.pi / 2 - math.rad(0.1) * math.cos(math.sqrt(-g) * 1)'")).scenes.at(0);
  EXPECT_TRUE(s.good()) << s.comparison_sentence << "; " << s.resolutions[0].solution_sentence;
  // d/dg of the closed form: A sin(sqrt(g) t) t / (2 sqrt(g)) u(g).
  const double w = std::sqrt(9.81);
  EXPECT_NEAR(s.u_input, std::abs(0.1 * M_PI / 180.0 * std::sin(w) / (2.0 * w) * 0.01), 1e-8);
  EXPECT_THAT(refusal(swing("formula: 'math.pi * x'")),
              testing::AllOf(HasSubstr("scenes.swing.reference.formula"), HasSubstr("undefined name 'x'")));
  EXPECT_THAT(refusal(swing("formula: '\"one\"'")), HasSubstr("without a finite number"));
  EXPECT_THAT(refusal(swing("formula: '1', value: 1")),
              HasSubstr("one of value, formula, measurement, at_most"));
}

TEST_F(VerificationReport, AnUpperBoundCountsTheUncertainties) {
  const auto bound = [&](double at_most) {
    std::string text = scene(kAngle);
    const std::size_t at = text.find("{value:");
    return text.replace(at, text.find('\n', at) - at,
                        "{at_most: " + std::to_string(at_most) + ", source: a drawing}");
  };
  const VerifiedScene wide = run(bound(1.3)).scenes.at(0);
  EXPECT_TRUE(wide.good()) << wide.comparison_sentence;
  EXPECT_FALSE(wide.good_from.has_value());
  EXPECT_NEAR(wide.good_to, 1.3 - 2.0 * wide.u_num, 1e-12);
  EXPECT_EQ(wide.resolutions.at(0).code, VerificationVerdict::not_demanded);
  EXPECT_EQ(run(bound(1.292)).scenes.at(0).comparison, VerificationVerdict::bad);
}

TEST_F(VerificationReport, RefinementsRunBesideOneAnotherAndAddUp) {
  std::string text = scene(kAngle);
  const std::string more =
      ", gravity: {settings: [['world.gravity_m_per_s2[2]=-9.85'], ['world.gravity_m_per_s2[2]=-9.82'], "
      "['world.gravity_m_per_s2[2]=-9.81']], sizes: [4, 2, 1]}}";
  text.replace(text.find("formal_order: 4}}") + 16, 1, more);
  const VerifiedScene s = run(text).scenes.at(0);
  ASSERT_EQ(s.resolutions.size(), 2U);
  EXPECT_EQ(s.resolutions[1].runs.size(), 3U);
  EXPECT_EQ(s.resolutions[1].runs[0].point.value, s.result);
  EXPECT_EQ(s.resolutions[1].runs[0].setting, "world.gravity_m_per_s2[2]=-9.81");
  EXPECT_EQ(s.resolutions[1].convergence.state, GridState::monotone);
  EXPECT_DOUBLE_EQ(s.u_num, std::hypot(s.resolutions[0].u_num, s.resolutions[1].u_num));
  text.replace(text.find(", sizes: [4, 2, 1]"), 18, "");
  EXPECT_THAT(refusal(text), HasSubstr("resolutions.gravity.sizes"));
}

TEST_F(VerificationReport, ASceneWithoutRefinementsIsASingleRun) {
  std::string text = scene(kAngle);
  text.erase(text.find("    resolutions"));
  const VerifiedScene s = run(text + "    verdict: {tolerance: 0.001}\n").scenes.at(0);
  EXPECT_TRUE(s.good()) << s.comparison_sentence;
  EXPECT_EQ(s.u_num, 0.0);
}

// Scenes of takt's own report that take a second or two; the whole of it is a command (docs/verification.md).
TEST(VerificationOfTakt, ShortScenesAreGood) {
  const VerificationPlan plan =
      read_verification_plan(std::string(TAKT_CONFIG_DIR) + "/verification/takt.yaml");
  VerificationOptions options;
  options.digest = [](const std::filesystem::path&) { return std::string(); };
  options.scenes = {"pendulum, rk4",   "robot r3", "flat punch", "press fit", "thesis table 5.1, level 1",
                    "thesis table 5.3"};
  const Verification done = verify(plan, options);
  EXPECT_EQ(done.scenes.size(), options.scenes.size());
  std::ostringstream words;
  print_verification(words, done);
  EXPECT_TRUE(done.good()) << words.str();
  options.scenes = {"no such scene"};
  try {
    verify(plan, options);
    ADD_FAILURE() << "an unknown scene is accepted";
  } catch (const ScenarioError& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(HasSubstr("--scene: found 'no such scene'; allowed: a scene of "),
                               HasSubstr(": 'pendulum, rk4', 'pendulum, rk2', ")));
  }
}

TEST_F(VerificationReport, PageAndJsonSayTheSame) {
  const Verification done = run(scene(kAngle + 1e-3));
  const nlohmann::ordered_json report = verification_json(done);
  EXPECT_EQ(report["verdict"], "bad");
  EXPECT_EQ(report["scenes"][0]["resolutions"][0]["runs"].size(), 3U);
  std::ostringstream page;
  write_verification_page(page, report);
  EXPECT_THAT(page.str(), HasSubstr("<span class=\"failed\">bad</span>"));
  EXPECT_THAT(page.str(), HasSubstr(report["scenes"][0]["model_hash"].get<std::string>()));
  std::ostringstream words;
  print_verification(words, done);
  EXPECT_THAT(words.str(), HasSubstr("BAD   pendulum: |E| = "));
}

TEST_F(VerificationReport, ThePageHasTheDigitsThatSeparateAResultFromItsLimits) {
  const Verification done = run(scene(kAngle, "    verdict: {tolerance: 1e-7}\n") +
                                "  refused:\n    scenario: " TAKT_CONFIG_DIR
                                "/verification/pendulum.yaml\n"
                                "    set: [no_such_key=1]\n    quantity: time\n    unit: s\n"
                                "    reference: {value: 1, source: the test}\n");
  std::ostringstream page;
  write_verification_page(page, verification_json(done));
  for (const double limit : {kAngle - 1e-7, kAngle + 1e-7})
    EXPECT_THAT(page.str(), HasSubstr(number_text(limit, 10)));
  EXPECT_THAT(page.str(), HasSubstr("1 of 2 scenes are good. 1 scene was not run."));
}

TEST_F(VerificationReport, ThePicturedErrorsLieOnTheLineOfTheFormalOrder) {
  std::ostringstream page;
  write_verification_page(page, verification_json(run(scene(kAngle))));
  const std::string text = page.str(), number = "([0-9.]+)";
  const auto all = [](const std::string& in, const std::string& pattern) {
    const std::regex regex(pattern);
    std::vector<std::pair<double, double>> found;
    for (std::sregex_iterator it(in.begin(), in.end(), regex), end; it != end; ++it)
      found.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
    return found;
  };
  const auto runs = all(text, "<circle [^>]*cx=\"" + number + "\" cy=\"" + number + "\"");
  ASSERT_EQ(runs.size(), 5U) << "three runs, and the ends of the line";
  EXPECT_THAT(text, HasSubstr("formal order 4"));
  EXPECT_NEAR(runs[0].second, runs[3].second, 0.1) << "the line begins at the finest run";
  EXPECT_NEAR(runs[2].first, runs[4].first, 0.1);
  EXPECT_NEAR(runs[2].second, runs[4].second, 15.0) << "of 240: two decades and a half";
  EXPECT_GT(runs[0].second - runs[2].second, 150.0);
}

TEST_F(VerificationReport, PureNumbersHaveNoUnit) {
  std::string counts = scene(kAngle, "    verdict: {tolerance: 0.1}\n");
  counts.replace(counts.find("unit: rad"), 9, "unit: \"1\"");
  const Verification done = run(counts);
  std::ostringstream words;
  print_verification(words, done);
  EXPECT_THAT(words.str(), HasSubstr("<= 0.1 (stated tolerance)\n"));
  EXPECT_THAT(words.str(), testing::Not(HasSubstr(" 1\n")));
}

}  // namespace
}  // namespace takt
