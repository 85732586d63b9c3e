// What FMUs of other tools use more rarely, by the FMU of support/fmus/features_fmu.c, whose outputs are
//   y[i] = factor(mode) * u[i] + offset,
// and descriptions that state steps and limits in their own ways, over the library of the motor.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/support/fmu_cell.h"
#include "tests/support/zip_file.h"

namespace takt {
namespace {

using test::FmuCell;
using test::kTestFmus;
using test::refusal_of_fmu;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::filesystem::path kFeatures = kTestFmus / "features.fmu";

std::string notes(const FmuCell& cell) {
  std::string all;
  for (const ImportNote& note : cell.model()->import_notes) all += note.sentence + "\n";
  return all;
}

TEST(FmuFeatures, ArraysTextsEnumerationsAndResourcesActAsTheFmuStates) {
  FmuCell usual(kFeatures, "step_s: 0.001");
  EXPECT_EQ(usual.value("y_1"), 0.5);
  usual.command("u_2", 3.0);
  ASSERT_TRUE(usual.step());
  EXPECT_EQ(usual.value("y_1"), 0.5);
  EXPECT_EQ(usual.value("y_2"), 3.5);
  EXPECT_EQ(usual.device().signals[usual.index("u_1")].unit, "mm");
  FmuCell other(kFeatures,
                "step_s: 0.001, parameters: {mode: reversed, file: other.txt}, start: {'u[1]': 7}");
  EXPECT_EQ(other.value("y_1"), 993.0);
  other.command("u_2", 3.0);
  ASSERT_TRUE(other.step());
  EXPECT_EQ(other.value("y_1"), 993.0);
  EXPECT_EQ(other.value("y_2"), 997.0);
  FmuCell by_number(kFeatures, "step_s: 0.001, parameters: {mode: 2}, outputs: ['länge[1]']");
  EXPECT_EQ(by_number.value("l_nge_1"), 0.5);
  EXPECT_THAT(
      refusal_of_fmu(kFeatures, "parameters: {mode: backwards}"),
      HasSubstr("found 'backwards'; allowed: a whole number or one of its names, as it is, reversed"));
  EXPECT_THAT(refusal_of_fmu(kFeatures, "parameters: {file: absent.txt}"),
              HasSubstr("answered fmi3Error to fmi3EnterInitializationMode"));
}

TEST(FmuFeatures, ATunableParameterCanBeAnInput) {
  FmuCell cell(kFeatures, "step_s: 0.001, start: {'u[1]': 7}, inputs: [mode]");
  EXPECT_EQ(cell.value("mode"), 1.0);
  ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.value("y_1"), 7.5);
  cell.command("mode", 2.0);
  ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.value("y_1"), -6.5) << cell.notices();
  EXPECT_EQ(FmuCell(kFeatures, "step_s: 0.001, parameters: {mode: 2}, inputs: [mode]").value("mode"), 2.0);
  EXPECT_THAT(refusal_of_fmu(kFeatures, "inputs: [long_start]"),
              HasSubstr("'long_start' has the causality parameter; allowed: inputs, and parameters with the "
                        "variability tunable"));
}

TEST(FmuFeatures, AStructuralParameterSetsTheSizesOfArrays) {
  FmuCell cell(kFeatures, "step_s: 0.001, parameters: {n: 5}, start: {'u[4]': 1}");
  cell.command("u_5", 2.0);
  ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.value("y_3"), 0.5);
  EXPECT_EQ(cell.value("y_4"), 1.5);
  EXPECT_EQ(cell.value("y_5"), 2.5);
  FmuCell one(kFeatures,
              "step_s: 0.001, parameters: {n: 40}, inputs: ['u[39]'], outputs: ['y[39]', 'y[40]', length]");
  one.command("u_39", 2.0);
  ASSERT_TRUE(one.step());
  EXPECT_EQ(one.value("length"), 40.0);
  EXPECT_EQ(one.value("y_39"), 2.5);
  EXPECT_EQ(one.value("y_40"), 0.5);
  EXPECT_THAT(refusal_of_fmu(kFeatures, "parameters: {n: 40}"),
              HasSubstr("found 40 inputs and 40 outputs; allowed: 31"));
  EXPECT_THAT(refusal_of_fmu(kFeatures, "parameters: {n: 101}"),
              HasSubstr("found 101; allowed: from 1 up to 100"));
  EXPECT_THAT(refusal_of_fmu(kFeatures, "start: {n: 3}"), HasSubstr("'n' is a parameter"));
}

TEST(FmuFeatures, WhatIsNotUsedHarmsNothing) {
  const FmuCell cell(kFeatures, "step_s: 0.001");
  EXPECT_EQ(cell.device().signals.size(), 5U);
  EXPECT_THAT(notes(cell), HasSubstr("no signals are picture, camera, unsized of the FMU"));
  EXPECT_THAT(refusal_of_fmu(kFeatures, "outputs: ['camera[1]']"),
              HasSubstr("'camera' has more than 10000 elements"));
  EXPECT_THAT(refusal_of_fmu(kFeatures, "outputs: ['unsized[1]']"),
              HasSubstr("a dimension of 'unsized' has no size"));
  EXPECT_THAT(refusal_of_fmu(kFeatures, "outputs: [picture]"), HasSubstr("'picture' has the type Binary"));
  EXPECT_THAT(refusal_of_fmu(kFeatures, "inputs: [tick]"), HasSubstr("'tick' has the type Clock"));
}

/// It refuses a second instance in its process.
TEST(FmuFeatures, AResetIsThatOfAFreshInstanceInAFreshProcess) {
  FmuCell cell(kFeatures, "step_s: 0.001");
  cell.command("u_1", 3.0);
  ASSERT_TRUE(cell.step(2));
  const std::uint64_t hash = cell.simulation().state_hash();
  cell.simulation().reset();
  EXPECT_EQ(cell.value("failed"), 0.0) << cell.notices();
  EXPECT_EQ(cell.value("y_1"), 0.5);
  cell.command("u_1", 3.0);
  ASSERT_TRUE(cell.step(2));
  EXPECT_EQ(cell.simulation().state_hash(), hash);
}

/// A library may open its licence, or a model its files, in its first step.
TEST(FmuFeatures, TheFirstStepHasTheTimeOfAStart) {
  FmuCell cell(kFeatures, "step_s: 0.001, timeout_s: 1, parameters: {long_start: 1.5}");
  ASSERT_TRUE(cell.step(2));
  EXPECT_EQ(cell.value("failed"), 0.0) << cell.notices();
}

TEST(FmuFeatures, AStepOfOneSizeMayBeAnother) {
  FmuCell cell(kFeatures, "step_s: 0.02", 0.01);
  EXPECT_THAT(notes(cell),
              HasSubstr("takes steps of 0.02 s; its description prefers step_s: 0.1 and states"));
  cell.command("u_1", 3.0);
  ASSERT_TRUE(cell.step(4));
  EXPECT_EQ(cell.value("y_1"), 3.5);
  EXPECT_THAT(notes(FmuCell(kFeatures, "", 0.1)), Not(HasSubstr("prefers")));
}

/// Its library has functions of Python and names no library that has them. Without an interpreter it is refused.
TEST(FmuFeatures, ALibraryThatNeedsPythonFindsTheInterpreter) {
  const std::filesystem::path fmu = kTestFmus / "python.fmu";
  if (const std::string why = refusal_of_fmu(fmu); why != "accepted") {
    EXPECT_THAT(why, HasSubstr("needs Python, which this machine does not have: install libpython3"));
    return;
  }
  FmuCell cell(fmu), winding(kTestFmus / "winding.fmu");
  for (FmuCell* one : {&cell, &winding}) {
    one->command("u", 12.0);
    ASSERT_TRUE(one->step(100));
  }
  EXPECT_GT(cell.value("i"), 1.0);
  EXPECT_EQ(cell.value("i"), winding.value("i"));
}

/// The clock ticks at 0.1 s + k * 0.2 s; inputs count from the step on that begins with the tick.
TEST(FmuClocks, TickInEventModeWithTheInputsOfTheInstant) {
  FmuCell cell(kTestFmus / "clocked.fmu", "", 0.05);
  for (int i = 1; i <= 40; ++i) {
    cell.command("u", i);
    ASSERT_TRUE(cell.step());
    // Step i leads from (i - 1) * 0.05 s to i * 0.05 s; ticks begin the steps 3, 7, 11, ...
    const int ticks = (i + 1) / 4;
    EXPECT_EQ(cell.value("count"), ticks) << i << cell.notices();
    EXPECT_EQ(cell.value("y"), ticks == 0 ? 0.0 : 4.0 * ticks - 1.0) << i;
    EXPECT_EQ(cell.value("level"), i * 0.05 > 0.52 ? cell.value("y") : 0.0) << i;
  }
  EXPECT_EQ(cell.value("failed"), 0.0) << cell.notices();
  EXPECT_THAT(notes(cell), Not(HasSubstr("ticks")));
  EXPECT_THAT(
      notes(FmuCell(kTestFmus / "clocked.fmu", "", 0.03)),
      HasSubstr("the clock 'sampling' of the FMU ticks every 0.2 s, at the end of the step of 0.03 s"));
  EXPECT_THAT(
      refusal_of_fmu(kTestFmus / "clocked.fmu", "", 0.3),
      HasSubstr("its clock 'sampling' ticks every 0.2 s; found a step of 0.3 s; allowed: up to this"));
}

/// sample belongs to the clock trigger: set without its tick it is an error of the FMU. tock ticks with trigger.
TEST(FmuClocks, ATriggeredClockIsASignal) {
  FmuCell cell(kTestFmus / "clocked.fmu", "", 0.05);
  EXPECT_EQ(cell.device().signals[cell.index("trigger")].type, SignalType::boolean);
  const auto step_with = [&](const char* signal, double value) {
    cell.command(signal, value);
    ASSERT_TRUE(cell.step());
    EXPECT_EQ(cell.value("failed"), 0.0) << cell.notices();
  };
  step_with("sample", 5.0);
  EXPECT_EQ(cell.value("held"), 0.0);
  EXPECT_EQ(cell.value("tock"), 0.0);
  step_with("trigger", 1.0);
  EXPECT_EQ(cell.value("held"), 5.0);
  EXPECT_EQ(cell.value("tock"), 1.0);
  step_with("trigger", 0.0);
  EXPECT_EQ(cell.value("tock"), 0.0);
  step_with("sample", 7.0);
  EXPECT_EQ(cell.value("held"), 5.0);
  EXPECT_THAT(notes(cell), HasSubstr("the clock 'planned' of the FMU does not tick"));
}

/// It ends at 3 s: its outputs are those of 3 s, and the step after it fails.
TEST(FmuClocks, AnEndOfTheSimulationHasItsOutputs) {
  FmuCell cell(kTestFmus / "clocked.fmu", "", 0.05);
  ASSERT_TRUE(cell.step(60));
  EXPECT_EQ(cell.value("failed"), 0.0) << cell.notices();
  EXPECT_EQ(cell.value("count"), 15.0);
  ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.value("failed"), 1.0);
  EXPECT_THAT(cell.notices(), HasSubstr("the FMU ended its simulation at 3.0"));
  EXPECT_EQ(cell.value("count"), 15.0);
}

/// The motor of FMI 3.0 with another description: `text` of it replaced by `by`.
class OtherMotor {
 public:
  OtherMotor(const std::string& text, const std::string& by,
             const std::vector<std::string>& libraries = {"motor.so"}) {
    std::string xml = content(kTestFmus / "motor3" / "modelDescription.xml");
    const std::size_t at = xml.find(text);
    EXPECT_NE(at, std::string::npos);
    xml.replace(at, text.size(), by);
    std::vector<test::ZipEntry> entries{{"modelDescription.xml", xml}};
    const std::string folder = "binaries/x86_64-linux/";
    for (const std::string& library : libraries)
      entries.push_back({folder + library, content(kTestFmus / "motor3" / folder / "motor.so")});
    test::write_zip(directory_ / "motor.fmu", entries);
  }
  std::filesystem::path fmu() const { return directory_ / "motor.fmu"; }

 private:
  static std::string content(const std::filesystem::path& file) {
    std::ostringstream out;
    out << std::ifstream(file, std::ios::binary).rdbuf();
    return out.str();
  }
  test::TemporaryDirectory directory_;
};

TEST(FmuStep, AnInternalStepDividesTheStepOfTheFmu) {
  const OtherMotor motor(
      "canHandleVariableCommunicationStepSize=\"true\"",
      "canHandleVariableCommunicationStepSize=\"true\" fixedInternalStepSize=\"0.0020000001\"");
  EXPECT_EQ(refusal_of_fmu(motor.fmu(), "step_s: 0.002"), "accepted") << "a number with few digits";
  EXPECT_EQ(refusal_of_fmu(motor.fmu(), "", 0.006), "accepted");
  EXPECT_THAT(
      refusal_of_fmu(motor.fmu(), "step_s: 0.001"),
      HasSubstr(
          "its internal step is 0.0020000001 s; found a step of 0.001 s; allowed: a whole multiple, e.g. "
          "step_s: 0.0020000001"));
  EXPECT_THAT(refusal_of_fmu(motor.fmu(), "", 0.003), HasSubstr("found a step of 0.003 s"));
}

/// FMUs written in Python state this, and run in their process.
TEST(FmuTool, OneThatIsNeededIsNamedAndMayBePartOfTheFmu) {
  const OtherMotor motor("modelIdentifier=\"motor\"",
                         "modelIdentifier=\"motor\" needsExecutionTool=\"true\"");
  FmuCell cell(motor.fmu());
  EXPECT_THAT(notes(cell), HasSubstr("needs a C compiler to run (needsExecutionTool)"));
  cell.command("motor_u", 12.0);
  ASSERT_TRUE(cell.step(10));
  EXPECT_GT(cell.value("motor_w"), 1.0);
  const OtherMotor absent(
      "instantiationToken=\"motor\" generationTool=\"a C compiler\">\n  <CoSimulation",
      "instantiationToken=\"none\" generationTool=\"T\">\n  <CoSimulation needsExecutionTool=\"true\"");
  EXPECT_THAT(refusal_of_fmu(absent.fmu(), ""),
              AllOf(HasSubstr("returned no instance"),
                    HasSubstr("It needs T (needsExecutionTool), which takt lets it neither")));
}

/// Of an FMU that was renamed by hand.
TEST(FmuLibraryFile, TheOnlyOneIsTakenWhateverItsName) {
  const std::string token = "instantiationToken=\"motor\"";
  const OtherMotor one(token, token, {"renamed.so"}), two(token, token, {"a.so", "b.so"});
  FmuCell cell(one.fmu());
  EXPECT_THAT(notes(cell), HasSubstr("names the library motor.so; takes the only one there, renamed.so"));
  cell.command("motor_u", 12.0);
  ASSERT_TRUE(cell.step(10));
  EXPECT_GT(cell.value("motor_w"), 1.0);
  EXPECT_THAT(refusal_of_fmu(two.fmu(), ""),
              HasSubstr("no binary for this platform, binaries/x86_64-linux/motor.so; found there only "));
}

TEST(FmuLimits, ThatContradictEachOtherLimitNothing) {
  const OtherMotor motor("min=\"-24\" max=\"24\"", "min=\"24\" max=\"-24\"");
  FmuCell cell(motor.fmu());
  cell.command("motor_u", 12.0);
  ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.value("motor_u"), 12.0);
}

}  // namespace
}  // namespace takt
