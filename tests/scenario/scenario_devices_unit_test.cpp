// Heat, furnaces and assertions in scenario files: reading, and errors for mistakes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/devices/furnace.h"
#include "server/scenario/scenario_reader.h"
#include "tests/support/kept_scenarios.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

const std::string kFurnace = R"(
    chamber: {center: {position_m: [0, 0, 0.4]}, size_m: [0.7, 0.7, 0.7]}
    mass_kg: 200
    specific_heat_J_per_kg_K: 900
    convection_W_per_m2_K: 15
    loss_W_per_m2_K: 0.8
    set_temperature_degC: 300
    control: {gain_W_per_K: 2000, integral_time_s: 600, max_power_W: 9000}
)";

Scenario read_scenario_text(const std::string& text) {
  const test::TemporaryDirectory directory;
  directory.write("cell.yaml", "takt_scenario: 1\nname: cell\n" + text);
  const std::string whole = "takt_scenario: 1\nname: cell\n" + text;
  try {
    Scenario scenario = read_scenario(directory.path() / "cell.yaml");
    test::keep_scenario(whole, {}, "");
    return scenario;
  } catch (const ScenarioError& error) {
    test::keep_scenario(whole, {}, error.what());
    throw;
  }
}

std::string scenario_error_of(const std::string& text) {
  try {
    read_scenario_text(text);
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "";
}

TEST(ScenarioDevices, FurnacesAreRead) {
  const Scenario scenario =
      read_scenario_text("world: {temperature_degC: 25}\nfurnaces:\n  Oven:" + kFurnace);
  EXPECT_EQ(scenario.temperature_degC, 25.0);
  ASSERT_EQ(scenario.devices.size(), 1U);
  EXPECT_EQ(scenario.devices[0].name, "Oven");
  const auto furnace = std::any_cast<ScenarioFurnace>(scenario.devices[0].section);
  EXPECT_EQ(furnace.X_GV.p, Vec3(0.0, 0.0, 0.4));
  EXPECT_EQ(furnace.set_temperature_degC, 300.0);
  EXPECT_FALSE(furnace.air_capacity_J_per_K.has_value());
  EXPECT_EQ(furnace.max_power_W, 9000.0);
}

TEST(ScenarioDevices, MistakesInScrewJointsAreReported) {
  const std::string driver =
      "screwdrivers:\n  Driver: {gripper: Hand, max_speed_rad_per_s: 60, max_torque_N_m: 4}\n";
  const std::string answer = scenario_error_of(driver);
  EXPECT_THAT(answer, HasSubstr("cell.yaml:4"));
  EXPECT_THAT(answer, HasSubstr("screwdrivers.Driver.gripper: found 'Hand'"));
  EXPECT_THAT(answer, HasSubstr("a gripper of this scenario: none"));
}

TEST(ScenarioDevices, MistakesNameFileLineAndKey) {
  const auto without = [](const std::string& line) {
    std::string text = kFurnace;
    text.erase(text.find(line), line.size());
    return text;
  };
  EXPECT_THAT(scenario_error_of("furnaces:\n  Oven:" + without("mass_kg: 200")),
              HasSubstr("furnaces.Oven.mass_kg"));
  EXPECT_THAT(scenario_error_of("furnaces:\n  Oven:" + kFurnace + "    colour: 1\n"), HasSubstr("colour"));
  EXPECT_THAT(scenario_error_of("furnaces:\n  Oven:" + kFurnace + "    ground: Floor\n"),
              HasSubstr("a ground of this scenario: none"));
  EXPECT_THAT(scenario_error_of("furnaces:\n  Oven:" + kFurnace + "    max_set_temperature_degC: 250\n"),
              HasSubstr("cell.yaml:10"));  // the set temperature's line
  EXPECT_THAT(scenario_error_of("furnaces:\n  9Oven:" + kFurnace), HasSubstr("the name '9Oven'"));
  EXPECT_THAT(scenario_error_of(
                  "processes: {all: {level_of_detail: 1, members: [Oven]}}\nfurnaces:\n  Oven:" + kFurnace),
              HasSubstr("the member 'Oven'"));
}

TEST(ScenarioDevices, AssertionsAreReadOrRefused) {
  const std::string oven = "furnaces:\n  Oven:" + kFurnace + "assertions:\n";
  const Scenario scenario =
      read_scenario_text(oven +
                         "  hot: {check: signal, device: Oven, signal: temperature, above: 299, time_s: 5}\n"
                         "  thrifty: {check: energy, of: Oven, below: 1.0e+6}\n");
  ASSERT_EQ(scenario.assertions.size(), 2U);
  EXPECT_EQ(scenario.assertions[0].name, "hot");
  EXPECT_EQ(scenario.assertions[0].time_s, 5.0);
  EXPECT_EQ(scenario.assertions[0].lower, 299.0);
  EXPECT_EQ(scenario.assertions[1].upper, 1e6);
  EXPECT_THAT(scenario_error_of(oven + "  a: {check: warm}\n"), HasSubstr("contact_force, pose, held_by"));
  EXPECT_THAT(scenario_error_of(oven + "  a: {check: energy, of: Oven}\n"),
              HasSubstr("neither 'above' nor 'below'"));
  EXPECT_THAT(scenario_error_of(oven + "  a: {check: energy, of: Stove, below: 1}\n"), HasSubstr("Oven"));
  EXPECT_THAT(scenario_error_of(oven + "  a: {check: pose, part: P, tolerance_m: 1}\n"),
              HasSubstr("a part of this scenario"));
  EXPECT_THAT(scenario_error_of(oven + "  a: {check: no_collision}\n"), HasSubstr("collision_checking"));
  EXPECT_THAT(scenario_error_of(oven + "  a: {check: contact_force, pair: [A], below: 1}\n"),
              HasSubstr("two names"));
}

TEST(ScenarioDevices, FrictionOverTemperatureIsATable) {
  const std::string begin = "contact:\n  pairs:\n    - {pair: [A, B], friction_at_degC: ";
  const Scenario scenario = read_scenario_text(begin + "[[20, 30], [280, 0.6]]}\n");
  ASSERT_EQ(scenario.contact.pairs.size(), 1U);
  ASSERT_EQ(scenario.contact.pairs[0].friction_at_degC.size(), 2U);
  EXPECT_EQ(scenario.contact.pairs[0].friction_at_degC[1][1], 0.6);
  for (const char* wrong : {"0.6", "[]", "[20]", "[[20, 30], [20, 1]]", "[[20, -1]]", "[[20, x]]"})
    EXPECT_THAT(scenario_error_of(begin + wrong + "}\n"), HasSubstr("rising temperatures")) << wrong;
}

TEST(ScenarioDevices, ProgramParametersAreNumbers) {
  const Scenario scenario = read_scenario_text("controller: {parameters: {offset_m: 0.5}}\n");
  EXPECT_EQ(scenario.program_parameters.at("offset_m"), 0.5);
  EXPECT_THAT(scenario_error_of("controller: {parameters: {offset_m: far}}\n"),
              HasSubstr("controller.parameters.offset_m"));
}

}  // namespace
}  // namespace takt
