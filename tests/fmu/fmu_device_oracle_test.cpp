// A DC motor as an FMU of FMI 2.0 and 3.0, in a cell, against its closed form; its steps, states and hashes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "server/simulation/model/model_hash.h"
#include "tests/support/fmu_cell.h"

namespace takt {
namespace {

using test::FmuCell;
using test::kTestFmus;
using test::refusal_of_fmu;
using testing::HasSubstr;

/// Speed of the motor after a step of the voltage from rest:
///   L J w'' + (L d + R J) w' + (R d + k^2) w = k u.
double closed_form_speed(double t, double u, double load = 0.0) {
  const double R = 1.0, L = 0.01, k = 0.1, J = 0.001, d = 0.0001;
  const double a = (L * d + R * J) / (L * J), b = (R * d + k * k) / (L * J);
  const std::complex<double> root = std::sqrt(std::complex<double>(a * a / 4.0 - b));
  const std::complex<double> p = -a / 2.0 + root, q = -a / 2.0 - root;
  const double end = (k * u - R * load) / (R * d + k * k);
  // w(0) = 0, w'(0) = -load / J.
  const std::complex<double> A = (-load / J + q * end) / (p - q), B = -end - A;
  return (end + A * std::exp(p * t) + B * std::exp(q * t)).real();
}

class Motor : public testing::TestWithParam<int> {
 protected:
  static std::filesystem::path fmu() { return kTestFmus / ("motor" + std::to_string(GetParam()) + ".fmu"); }
};
INSTANTIATE_TEST_SUITE_P(Versions, Motor, testing::Values(2, 3));

TEST_P(Motor, RunsUpAsItsClosedFormSays) {
  FmuCell cell(fmu());
  cell.command("motor_u", 12.0);
  for (int i = 1; i <= 300; ++i) {
    ASSERT_TRUE(cell.step());
    ASSERT_NEAR(cell.value("motor_w"), closed_form_speed(1e-3 * i, 12.0), 1e-5) << i;
  }
  EXPECT_EQ(cell.value("failed"), 0.0);
}

TEST_P(Motor, HasTheSignalsUnitsTypesAndLimitsOfItsDescription) {
  const FmuCell cell(fmu());
  const SignalDescription& u = cell.device().signals[cell.index("motor_u")];
  EXPECT_TRUE(u.commanded);
  EXPECT_EQ(u.unit, "V");
  EXPECT_EQ(u.lower, -24.0);
  EXPECT_EQ(u.upper, 24.0);
  EXPECT_EQ(cell.device().signals[cell.index("brake")].type, SignalType::boolean);
  EXPECT_EQ(cell.device().signals[cell.index("result")].type, SignalType::integer);
  EXPECT_FALSE(cell.device().signals[cell.index("motor_w")].commanded);
  EXPECT_EQ(cell.device().type, "fmus");
}

TEST_P(Motor, TakesChosenSignalsParametersAndStartValues) {
  FmuCell cell(fmu(),
               "parameters: {R: 2, k: 0.2}, start: {motor.u: 6, motor.w: 10}, inputs: {load: motor.load}, "
               "outputs: {speed: motor.w, resistance: R}");
  ASSERT_EQ(cell.device().signals.size(), 4U);
  EXPECT_EQ(cell.value("speed"), 10.0);
  EXPECT_EQ(cell.value("resistance"), 2.0);
  // The voltage of its start value is held though it is no signal.
  ASSERT_TRUE(cell.step(3000));
  EXPECT_NEAR(cell.value("speed"), 0.2 * 6.0 / (2.0 * 0.0001 + 0.04), 1e-3);
}

TEST_P(Motor, StepsOncePerSeveralStepsOfTheCellWithItsOutputsHeld) {
  FmuCell cell(fmu(), "step_s: 0.005");
  cell.command("motor_u", 12.0);
  for (int i = 1; i <= 100; ++i) {
    ASSERT_TRUE(cell.step());
    const int begun = i / 5 * 5;
    ASSERT_NEAR(cell.value("motor_w"), begun == 0 ? 0.0 : closed_form_speed(1e-3 * begun, 12.0), 1e-5) << i;
  }
}

TEST_P(Motor, InputsActFromTheBeginningOfTheStepOn) {
  FmuCell cell(fmu());
  ASSERT_TRUE(cell.step(2));
  cell.command("motor_load", -0.01);
  ASSERT_TRUE(cell.step());
  EXPECT_NEAR(cell.value("motor_w"), closed_form_speed(1e-3, 0.0, -0.01), 1e-9);
  cell.command("brake", 1.0);
  ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.value("motor_w"), 0.0);
}

TEST_P(Motor, TheSameStepsGiveTheSameBitsAlsoAfterAResetAndFromASavedState) {
  FmuCell one(fmu()), other(fmu());
  one.command("motor_u", 12.0), other.command("motor_u", 12.0);
  ASSERT_TRUE(one.step(50));
  ASSERT_TRUE(other.step(50));
  EXPECT_EQ(one.simulation().state_hash(), other.simulation().state_hash());
  std::vector<std::byte> state;
  ASSERT_EQ(one.simulation().save_state(state), "");
  ASSERT_TRUE(one.step(50));
  const std::uint64_t later = one.simulation().state_hash();
  const double speed = one.value("motor_w");
  ASSERT_EQ(one.simulation().restore_state(state), "");
  ASSERT_TRUE(one.step(50));
  EXPECT_EQ(one.simulation().state_hash(), later);
  EXPECT_EQ(one.value("motor_w"), speed);
  // In another process.
  ASSERT_EQ(other.simulation().restore_state(state), "");
  ASSERT_TRUE(other.step(50));
  EXPECT_EQ(other.simulation().state_hash(), later);
  other.simulation().reset();
  EXPECT_EQ(other.value("motor_w"), 0.0);
  other.command("motor_u", 12.0);
  ASSERT_TRUE(other.step(100));
  EXPECT_EQ(other.simulation().state_hash(), later);
}

TEST_P(Motor, OutputsAndTheWholeFmuAreInTheHashes) {
  FmuCell one(fmu()), other(fmu()), again(fmu());
  one.command("motor_u", 12.0), other.command("motor_u", 12.5);
  ASSERT_TRUE(one.step());
  ASSERT_TRUE(other.step());
  EXPECT_NE(one.simulation().state_hash(), other.simulation().state_hash());
  const std::uint64_t usual = model_hash(*one.model());
  EXPECT_EQ(model_hash(*again.model()), usual);
  EXPECT_NE(model_hash(*FmuCell(fmu(), "parameters: {R: 1.5}").model()), usual);
  EXPECT_NE(model_hash(*FmuCell(fmu(), "start: {motor.load: 0.1}").model()), usual);
  EXPECT_NE(model_hash(*FmuCell(fmu(), "step_s: 0.002").model()), usual);
  EXPECT_NE(model_hash(*FmuCell(fmu(), "outputs: [motor.w]").model()), usual);
  // The same FMU with one byte more.
  const test::TemporaryDirectory directory;
  std::filesystem::copy_file(fmu(), directory / "changed.fmu");
  std::ofstream(directory / "changed.fmu", std::ios::app) << ' ';
  EXPECT_NE(model_hash(*FmuCell(directory / "changed.fmu").model()), usual);
}

TEST_P(Motor, WrongKeysAreRefusedWithTheirPlaceAndReason) {
  EXPECT_THAT(refusal_of_fmu(fmu(), "inputs: [motor.v]"), HasSubstr("cell.yaml:5:"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "inputs: [motor.v]"),
              HasSubstr("it has no variable 'motor.v'; it has R, L, k"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "inputs: [motor.w]"),
              HasSubstr("'motor.w' has the causality output; allowed: inputs, and parameters with the "
                        "variability tunable"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "outputs: [motor.u]"),
              HasSubstr("'motor.u' is no output but has the causality input"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "parameters: {motor.u: 1}"), HasSubstr("'motor.u' is no parameter"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "start: {R: 1}"),
              HasSubstr("'R' is a parameter; it stands under 'parameters'"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "parameters: {R: wide}"), HasSubstr("found 'wide'; allowed: a number"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "parameters: {trouble: 0.5}"), HasSubstr("allowed: a whole number"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "start: {brake: 2}"), HasSubstr("allowed: true or false"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "start: {motor.u: 30}"),
              HasSubstr("found 30; allowed: from -24 up to 24"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "step_s: 0.0015"),
              HasSubstr("found 0.0015; allowed: a whole multiple of solver.step_s, 0.001 s"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "inputs: {u-1: motor.u}"),
              HasSubstr("the signal 'u-1' cannot have this name"));
  EXPECT_THAT(refusal_of_fmu(fmu(), "outputs: {motor_u: motor.w}"),
              HasSubstr("two signals with the name 'motor_u'"));
}

TEST(Fmu, IsRefusedWithoutTheOptionAndElsewhere) {
  const test::TemporaryDirectory directory, elsewhere;
  const std::string fmu = (kTestFmus / "motor2.fmu").string();
  directory.write("cell.yaml", "takt_scenario: 1\nname: fmu\nfmus: {Motor: {file: " + fmu + "}}\n");
  EXPECT_THAT([&] { load_cell(directory / "cell.yaml"); },
              testing::ThrowsMessage<ScenarioError>(
                  HasSubstr("The option --allow-fmus DIR permits those in one directory")));
  FmuLibrary library(elsewhere.path(), test::kFmuHost);
  ImportOptions import;
  import.fmus = &library;
  EXPECT_THAT(
      [&] { load_cell(directory / "cell.yaml", {}, import); },
      testing::ThrowsMessage<ScenarioError>(HasSubstr("allowed: FMUs below the directory of --allow-fmus")));
  // A link in the directory that leads out of it.
  std::filesystem::create_symlink(fmu, elsewhere / "link.fmu");
  directory.write("cell.yaml", "takt_scenario: 1\nname: fmu\nfmus: {Motor: {file: " +
                                   (elsewhere / "link.fmu").string() + "}}\n");
  EXPECT_THROW(load_cell(directory / "cell.yaml", {}, import), ScenarioError);
}

}  // namespace
}  // namespace takt
