// The verification report end to end, on a scene with a closed form.
#include "server/headless/verification.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

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
    VerificationOptions options;
    options.version = "takt of the test";
    options.digest = [](const std::filesystem::path& of) { return "digest of " + of.filename().string(); };
    return verify(read_verification_plan(file), options);
  }
  std::string scene(double reference, const std::string& more = "") const {
    std::ostringstream text;
    text.precision(17);
    text << "  pendulum:\n    scenario: " << TAKT_CONFIG_DIR << "/verification/pendulum.yaml\n"
         << "    quantity: robots.Pendulum.position.bearing\n    unit: rad\n"
         << "    reference: {value: " << reference << ", exact: true, source: closed form}\n"
         << "    resolution: {key: solver.step_s, values: ['0.01', '0.005', '0.0025'], formal_order: 4}\n"
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
  EXPECT_TRUE(done.good()) << s.code_sentence << "; " << s.solution_sentence << "; " << s.comparison_sentence;
  ASSERT_EQ(s.runs.size(), 3U);
  ASSERT_TRUE(s.runs[0].error_order.has_value());
  EXPECT_NEAR(*s.runs[0].error_order, 4.0, 0.2);
  EXPECT_NEAR(s.convergence.extrapolated, kAngle, 0.1 * std::abs(s.error));
  EXPECT_LE(std::abs(s.error), 2.0 * s.u_num);
  EXPECT_EQ(s.files[0].digest, "digest of pendulum.yaml");
}

TEST_F(VerificationReport, AWrongReferenceIsABadVerdict) {
  const Verification done = run(scene(kAngle + 1e-3));
  EXPECT_FALSE(done.good());
  EXPECT_EQ(done.scenes[0].comparison, VerificationVerdict::bad);
  EXPECT_EQ(done.scenes[0].solution, VerificationVerdict::good);
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
  EXPECT_EQ(done.scenes[0].convergence.state, GridState::no_difference);
  EXPECT_EQ(done.scenes[0].solution, VerificationVerdict::bad);
  EXPECT_FALSE(done.good());
}

TEST_F(VerificationReport, ResultsWithoutAnOrderAreGoodWithinATenthOfATolerance) {
  const auto incline = [](const std::string& tolerance) {
    return "  incline:\n    scenario: " + std::string(TAKT_CONFIG_DIR) +
           "/scenarios/contact/incline.yaml\n    quantity: components.Slides.position.x\n    unit: m\n"
           "    reference: {value: 0.224471954, source: Coulomb friction}\n"
           "    resolution: {key: solver.step_s, values: ['0.002', '0.001', '0.0005']}\n"
           "    verdict: {tolerance: " +
           tolerance + "}\n";
  };
  const VerifiedScene wide = run(incline("0.0005")).scenes.at(0);
  EXPECT_NE(wide.convergence.state, GridState::monotone);
  EXPECT_TRUE(wide.good()) << wide.solution_sentence << "; " << wide.comparison_sentence;
  EXPECT_GT(wide.u_num, 0.0);
  const VerifiedScene narrow = run(incline("1e-8")).scenes.at(0);
  EXPECT_EQ(narrow.solution, VerificationVerdict::bad);
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
  EXPECT_EQ(s.code, VerificationVerdict::not_demanded);
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

TEST_F(VerificationReport, PageAndJsonSayTheSame) {
  const Verification done = run(scene(kAngle + 1e-3));
  const nlohmann::ordered_json report = verification_json(done);
  EXPECT_EQ(report["verdict"], "bad");
  EXPECT_EQ(report["scenes"][0]["solution_verification"]["runs"].size(), 3U);
  std::ostringstream page;
  write_verification_page(page, report);
  EXPECT_THAT(page.str(), HasSubstr("<span class=\"failed\">bad</span>"));
  EXPECT_THAT(page.str(), HasSubstr(report["scenes"][0]["model_hash"].get<std::string>()));
  std::ostringstream words;
  print_verification(words, done);
  EXPECT_THAT(words.str(), HasSubstr("BAD   pendulum: |E| = "));
}

}  // namespace
}  // namespace takt
