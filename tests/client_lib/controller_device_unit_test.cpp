// Devices and parameters in controller programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/controller_test_cell.h"

namespace takt::controller {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

CellDescription cell_with_oven() {
  CellDescription cell = block_cell();
  cell.devices = {{"Lamp", {{"on", "", true, 0.0, 1.0}}},
                  {"Oven",
                   {{"set_temperature", "degC", true, 0.0, 300.0},
                    {"door", "", true, 0.0, 1.0},
                    {"temperature", "degC", false, 0.0, 0.0}}}};
  return cell;
}

CellState state_at(const CellDescription& cell, double time_s, double temperature) {
  CellState state = initial_state(cell);
  state.time = time_s;
  state.devices = {{{0.0}}, {{20.0, 0.0, temperature}}};
  return state;
}

TEST(ControllerDevices, SignalsAreSetAndReadByNameAndKept) {
  const ProgramFile program(R"(
    local oven = device("Oven")
    routine("Robot1", function(r)
      r:wait(0.016)
      oven:set{door = 1, set_temperature = 120}
      r:wait_for(function(cell) return cell.devices.Oven.signals.temperature > 100 end)
      oven:set{door = 0}
    end))");
  const CellDescription cell = cell_with_oven();
  Controller controller(program.path(), cell);
  EXPECT_THAT(controller.driven_devices(), ElementsAre(1));
  const auto at = [&](double time_s, double temperature) -> const DeviceSetPoint& {
    return controller.update(state_at(cell, time_s, temperature)).devices.at(0);
  };
  EXPECT_TRUE(at(0.0, 20.0).signals.empty());  // nothing set yet
  EXPECT_TRUE(at(0.008, 20.0).signals.empty());
  EXPECT_THAT(at(0.016, 20.0).signals, ElementsAre(0, 1));
  EXPECT_THAT(at(0.024, 90.0).values, ElementsAre(120.0, 1.0));  // it stands
  EXPECT_THAT(at(0.032, 101.0).values, ElementsAre(120.0, 0.0));
  EXPECT_EQ(at(0.040, 101.0).device, 1);
}

std::string device_error_of(const std::string& text, const Parameters& parameters = {}) {
  const ProgramFile program(text);
  const CellDescription cell = cell_with_oven();
  try {
    Controller controller(program.path(), cell, parameters);
    controller.update(state_at(cell, 0.0, 20.0));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(ControllerDevices, MistakesAreReported) {
  const std::string end = "routine('Robot1', function(r) end)";
  EXPECT_THAT(device_error_of("device('Stove') " + end), HasSubstr("no device 'Stove'; it has Lamp, Oven"));
  EXPECT_THAT(device_error_of("local o = device('Oven') o:set{door = 1} " + end),
              HasSubstr("while routines run"));
  EXPECT_THAT(device_error_of("routine('Robot1', function(r) device('Oven') end)"),
              HasSubstr("while the program is loaded"));
  EXPECT_THAT(device_error_of("local o = device('Oven') routine('Robot1', function(r) o:set{lid = 1} end)"),
              HasSubstr("Oven has no signal 'lid'; it has set_temperature, door, temperature"));
  EXPECT_THAT(device_error_of("local o = device('Oven') routine('Robot1', function(r) o:set(1) end)"),
              HasSubstr("a table {SIGNAL = value"));
  EXPECT_THAT(device_error_of("routine('Robot1', function(r) local t = cell.devices.Oven.signals.heat end)"),
              HasSubstr("has no 'heat'; it has set_temperature, door, temperature"));
}

TEST(ControllerParameters, ParametersReplaceTheDefaultsOfAProgram) {
  const std::string text = R"(
    local offset = parameter("offset_m", 0.25)
    routine("Robot1", function(r) if offset ~= 0.25 then error("offset " .. offset) end end))";
  EXPECT_EQ(device_error_of(text), "");
  EXPECT_THAT(device_error_of(text, {{"offset_m", 0.5}}), HasSubstr("offset 0.5"));
  EXPECT_THAT(device_error_of(text, {{"ofset_m", 0.5}}),
              HasSubstr("the program has no parameter 'ofset_m'; it has offset_m"));
}

TEST(ControllerGrippers, OneThatIsLeftToAnotherControllerIsNotCommanded) {
  const CellDescription cell = cell_with_oven();
  const std::string leave = "leave_gripper('" + cell.grippers[0].name + "')\n";
  const ProgramFile program(leave + "routine('Robot1', function(r) r:wait(1) end)");
  Controller controller(program.path(), cell);
  EXPECT_THAT(controller.driven_robots(), ElementsAre(0));
  EXPECT_TRUE(controller.driven_grippers().empty());
  EXPECT_THAT(device_error_of(leave + "routine('Robot1', function(r) r.gripper:close() end)"),
              HasSubstr("has left this gripper to another controller"));
  EXPECT_THAT(device_error_of("leave_gripper('Hand')"), HasSubstr("the cell has no gripper 'Hand'"));
}

}  // namespace
}  // namespace takt::controller
