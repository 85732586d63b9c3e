// Signals of the cell by their names, wires, and forced values.
#include "server/simulation/model/signals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/service_cell.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

const std::string kDevices =
    "\nscrewdrivers: {Driver: {gripper: Gripper2, max_speed_rad_per_s: 60, max_torque_N_m: 4}}\n"
    "force_torque_sensors: {Wrist: {robot: Robot1}}\n";

std::shared_ptr<const CellModel> model_with(const std::string& more) {
  const test::TemporaryDirectory directory;
  directory.write("cell.yaml", test::service_scenario_text() + kDevices + more);
  return load_cell(directory.path() / "cell.yaml");
}
std::string error_of(const std::string& more) {
  try {
    model_with(more);
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "";
}
double value(const Simulation& simulation, const std::string& name) {
  return simulation.signal(find_signal(simulation.description(), name).value());
}
SignalRef ref(const Simulation& simulation, const std::string& name) {
  return find_signal(simulation.description(), name).value();
}
Command grip(int gripper, GripperAction action, double width_m = 0.0) {
  return GripperCommand{gripper, {}, action, width_m, 0.0};
}
Command driver_speed(const Simulation& simulation, double speed) {
  const auto& cell = simulation.description();
  const auto result = validate(cell, find_target(cell, "Driver"), RawDeviceCommand{{}, {"speed"}, {speed}});
  return std::get<DeviceCommand>(result);
}
void run(Simulation& simulation, int steps) {
  for (int i = 0; i < steps; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
}

TEST(Signals, DevicesGrippersAndRobotsHaveThem) {
  Simulation simulation(model_with(""));
  const CellDescription& cell = simulation.description();
  EXPECT_EQ(value(simulation, "Gripper1.width"), 0.1);
  EXPECT_EQ(value(simulation, "Gripper1.part"), -1.0);
  EXPECT_NEAR(value(simulation, "Robot1.shoulder_lift_joint"), -1.5707963267948966, 1e-15);
  EXPECT_TRUE(describe_signal(cell, ref(simulation, "Gripper1.close")).commanded);
  EXPECT_EQ(describe_signal(cell, ref(simulation, "Gripper1.part_present")).type, SignalType::boolean);
  EXPECT_EQ(describe_signal(cell, ref(simulation, "Gripper1.set_width")).upper, 0.15);
  EXPECT_EQ(signal_name(cell, ref(simulation, "Wrist.force_z")), "Wrist.force_z");
  for (const char* none : {"Gripper1", "Gripper1.open", "Nobody.x", "Robot1.", ""})
    EXPECT_FALSE(find_signal(cell, none)) << none;
  EXPECT_THAT(signals_there(cell, "Gripper1.open"), HasSubstr("signals of Gripper1: close, set_width"));
  EXPECT_THAT(signals_there(cell, "Nobody.x"),
              HasSubstr("Driver, Wrist, Gripper1, Gripper2, Robot1, Robot2"));
}

TEST(Signals, AGripperReportsTheSameAsItsSample) {
  Simulation simulation(model_with(""));
  Snapshot snapshot = simulation.make_snapshot();
  ASSERT_TRUE(simulation.step(std::vector<Command>{grip(0, GripperAction::width, 0.05)}));
  for (int i = 0; i < 400; ++i) {
    simulation.read_snapshot(snapshot);
    ASSERT_EQ(value(simulation, "Gripper1.width"), snapshot.grippers[0].width_m);
    ASSERT_EQ(value(simulation, "Gripper1.moving") != 0.0, snapshot.grippers[0].moving);
    ASSERT_EQ(value(simulation, "Gripper1.in_position") != 0.0, snapshot.grippers[0].in_position);
    run(simulation, 1);
  }
  EXPECT_EQ(value(simulation, "Gripper1.in_position"), 1.0);
  EXPECT_EQ(value(simulation, "Gripper1.set_width"), 0.05);
}

TEST(Wires, AnInputFollowsAnotherSignal) {
  Simulation simulation(
      model_with("wires: {Gripper2.close: Gripper1.closed, Driver.speed: 400 * Gripper1.width, Wrist.tare: "
                 "Gripper1.width < 0.06}\n"));
  run(simulation, 1);
  EXPECT_EQ(value(simulation, "Gripper2.close"), 0.0);
  EXPECT_NEAR(value(simulation, "Driver.speed"), 40.0, 1e-12);
  EXPECT_EQ(value(simulation, "Wrist.tare"), 0.0);
  ASSERT_TRUE(simulation.step(std::vector<Command>{grip(0, GripperAction::close)}));
  EXPECT_EQ(value(simulation, "Gripper2.close"), 1.0) << "commands come ahead of wires";
  // 0.075 m/s each jaw.
  const double seen_at_begin = value(simulation, "Gripper1.width");
  run(simulation, 1);
  EXPECT_NEAR(value(simulation, "Driver.speed"), 400.0 * seen_at_begin, 1e-12);
  run(simulation, 400);
  EXPECT_EQ(value(simulation, "Wrist.tare"), 1.0);
  ASSERT_TRUE(simulation.step(std::vector<Command>{grip(0, GripperAction::width, 0.15)}));
  run(simulation, 1200);
  EXPECT_EQ(value(simulation, "Driver.speed"), 60.0) << "within the limits of the input";
  EXPECT_EQ(value(simulation, "Gripper2.close"), 0.0);
  EXPECT_NEAR(value(simulation, "Gripper2.width"), 0.15, 1e-12);
}

TEST(Wires, AChainHasNoDelayInAnyOrder) {
  // The wire of the source comes later in the file.
  Simulation simulation(
      model_with("wires: {Wrist.tare: not Gripper2.close, Gripper2.close: Gripper1.close}\n"));
  ASSERT_EQ(simulation.description().wires.size(), 2U);
  EXPECT_EQ(simulation.description().wires[0].text, "Gripper1.close");
  run(simulation, 1);
  EXPECT_EQ(value(simulation, "Wrist.tare"), 1.0);
  ASSERT_TRUE(simulation.step(std::vector<Command>{grip(0, GripperAction::close)}));
  EXPECT_EQ(value(simulation, "Wrist.tare"), 0.0);
}

TEST(Wires, CommandsOfAWiredInputAreRejected) {
  const auto model = model_with("wires: {Gripper2.close: Gripper1.closed, Driver.speed: Wrist.force_z}\n");
  const CellDescription& cell = model->description;
  const auto device = validate(cell, find_target(cell, "Driver"), RawDeviceCommand{{}, {"speed"}, {1.0}});
  ASSERT_TRUE(std::holds_alternative<Rejection>(device));
  EXPECT_EQ(std::get<Rejection>(device).code, RejectionCode::wired_signal);
  EXPECT_THAT(std::get<Rejection>(device).message, HasSubstr("wired to 'Wrist.force_z'"));
  const auto gripper = validate(cell, find_target(cell, "Gripper2"), RawGripperCommand{});
  ASSERT_TRUE(std::holds_alternative<Rejection>(gripper));
  EXPECT_EQ(std::get<Rejection>(gripper).code, RejectionCode::wired_signal);
  EXPECT_TRUE(std::holds_alternative<GripperCommand>(
      validate(cell, find_target(cell, "Gripper1"), RawGripperCommand{})));
}

TEST(Wires, MistakesNameFileLineAndKey) {
  const std::string unknown = error_of("wires:\n  Driver.speed: Wrist.power\n");
  EXPECT_THAT(unknown,
              HasSubstr("wires.Driver.speed: found 'Wrist.power'; allowed: signals of Wrist: force_x"));
  EXPECT_THAT(unknown, HasSubstr("cell.yaml:"));
  EXPECT_THAT(error_of("wires: {Driver.torque: Wrist.force_z}\n"), HasSubstr("which can only be read"));
  EXPECT_THAT(error_of("wires: {Wrist.tare: Wrist.force_z}\n"),
              HasSubstr("a boolean signal, or a comparison"));
  EXPECT_THAT(error_of("wires: {Driver.speed: not Wrist.force_z}\n"), HasSubstr("not with a boolean signal"));
  EXPECT_THAT(error_of("wires: {Wrist.tare: Gripper1.closed > 1}\n"), HasSubstr("which is boolean"));
  EXPECT_THAT(error_of("wires: {Wrist.tare: Wrist.force_z > much}\n"), HasSubstr("a number after >"));
  EXPECT_THAT(error_of("wires: {Wrist.tare: a b}\n"), HasSubstr("SIGNAL, not SIGNAL"));
  EXPECT_THAT(error_of("wires: {Wrist.tare: ''}\n"), HasSubstr("wires.Wrist.tare"));
  EXPECT_THAT(error_of("wires: {Gripper1.close: Gripper2.close, Gripper2.close: Gripper1.close}\n"),
              HasSubstr("in a circle (Gripper1.close, Gripper2.close)"));
  EXPECT_THAT(error_of("wires: {Gripper1.close: Gripper2.closed, Gripper1.set_width: Gripper2.width}\n"),
              HasSubstr("one wired input for each gripper"));
  EXPECT_THAT(error_of("wires: [Wrist.tare]\n"), HasSubstr("a mapping of inputs to signals"));
}

TEST(ForcedSignals, AReportedSignalShowsTheForcedValueUntilItIsReleased) {
  Simulation simulation(model_with("wires: {Gripper2.close: Driver.engaged}\n"));
  const SignalRef engaged = ref(simulation, "Driver.engaged");
  run(simulation, 1);
  EXPECT_EQ(simulation.force_signal(engaged, 1.0), "");
  Snapshot snapshot = simulation.make_snapshot();
  EXPECT_EQ(snapshot.devices[0].signals[2], 1.0);
  EXPECT_EQ(snapshot.devices[0].forced, 1U << 2U);
  run(simulation, 3);
  EXPECT_EQ(value(simulation, "Driver.engaged"), 1.0);
  EXPECT_EQ(value(simulation, "Gripper2.close"), 1.0) << "wires see the forced value";
  EXPECT_EQ(simulation.release_signal(engaged), "");
  run(simulation, 1);
  simulation.read_snapshot(snapshot);
  EXPECT_EQ(snapshot.devices[0].signals[2], 0.0);
  EXPECT_EQ(snapshot.devices[0].forced, 0U);
  EXPECT_EQ(value(simulation, "Gripper2.close"), 0.0);
  EXPECT_THAT(simulation.release_signal(engaged), HasSubstr("Driver.engaged is not forced"));
}

TEST(ForcedSignals, AForcedInputTakesTheNewestCommandAtTheRelease) {
  Simulation simulation(model_with(""));
  const SignalRef speed = ref(simulation, "Driver.speed");
  ASSERT_TRUE(simulation.step(std::vector<Command>{driver_speed(simulation, 7.0)}));
  EXPECT_EQ(simulation.force_signal(speed, 5.0), "");
  EXPECT_EQ(value(simulation, "Driver.speed"), 5.0);
  EXPECT_EQ(simulation.force_signal(speed, 6.0), "");
  EXPECT_EQ(simulation.release_signal(speed), "");
  EXPECT_EQ(value(simulation, "Driver.speed"), 7.0);
  EXPECT_EQ(simulation.force_signal(speed, 5.0), "");
  ASSERT_TRUE(simulation.step(std::vector<Command>{driver_speed(simulation, 10.0)}));
  EXPECT_EQ(value(simulation, "Driver.speed"), 5.0);
  EXPECT_EQ(simulation.release_signal(speed), "");
  EXPECT_EQ(value(simulation, "Driver.speed"), 10.0);
}

TEST(ForcedSignals, AWiredInputCanBeForced) {
  Simulation simulation(model_with("wires: {Driver.speed: 400 * Gripper1.width}\n"));
  run(simulation, 1);
  const SignalRef speed = ref(simulation, "Driver.speed");
  EXPECT_EQ(simulation.force_signal(speed, 3.0), "");
  run(simulation, 2);
  EXPECT_EQ(value(simulation, "Driver.speed"), 3.0);
  EXPECT_EQ(simulation.release_signal(speed), "");
  EXPECT_NEAR(value(simulation, "Driver.speed"), 40.0, 1e-12);
}

TEST(ForcedSignals, AForcedGripperKeepsCommandsForTheRelease) {
  Simulation simulation(model_with(""));
  const SignalRef close = ref(simulation, "Gripper1.close");
  EXPECT_EQ(simulation.force_signal(close, 1.0), "");
  run(simulation, 100);
  EXPECT_LT(value(simulation, "Gripper1.width"), 0.1);
  EXPECT_EQ(simulation.release_signal(close), "");
  run(simulation, 400);
  EXPECT_NEAR(value(simulation, "Gripper1.width"), 0.1, 1e-12) << "the width of the time before";
  EXPECT_EQ(simulation.force_signal(close, 1.0), "");
  EXPECT_THAT(simulation.force_signal(ref(simulation, "Gripper1.set_width"), 0.1),
              HasSubstr("Gripper1.close is forced; release it first"));
  ASSERT_TRUE(simulation.step(std::vector<Command>{grip(0, GripperAction::width, 0.12)}));
  EXPECT_EQ(value(simulation, "Gripper1.close"), 1.0);
  EXPECT_EQ(simulation.release_signal(close), "");
  run(simulation, 1000);
  EXPECT_NEAR(value(simulation, "Gripper1.width"), 0.12, 1e-12);
  // Reported ones.
  EXPECT_EQ(simulation.force_signal(ref(simulation, "Gripper1.part"), 1.0), "");
  EXPECT_EQ(simulation.force_signal(ref(simulation, "Gripper1.width"), 0.5), "");
  const Snapshot snapshot = simulation.make_snapshot();
  EXPECT_EQ(snapshot.grippers[0].part, 1);
  EXPECT_EQ(snapshot.grippers[0].width_m, 0.5);
  EXPECT_EQ(snapshot.grippers[0].forced, 1U << static_cast<unsigned>(GripperSignal::part) |
                                             1U << static_cast<unsigned>(GripperSignal::width));
}

TEST(ForcedSignals, AreInTheHashAndInSavedStates) {
  const auto model = model_with("");
  Simulation forced(model), plain(model);
  run(forced, 2);
  run(plain, 2);
  EXPECT_EQ(forced.state_hash(), plain.state_hash());
  const SignalRef engaged = ref(forced, "Driver.engaged"), close = ref(forced, "Gripper2.close");
  EXPECT_EQ(forced.force_signal(engaged, 1.0), "");
  EXPECT_EQ(forced.force_signal(close, 1.0), "");
  run(forced, 5);
  run(plain, 5);
  EXPECT_NE(forced.state_hash(), plain.state_hash());
  std::vector<std::byte> bytes;
  ASSERT_EQ(forced.save_state(bytes), "");
  ASSERT_EQ(plain.restore_state(bytes), "");
  EXPECT_EQ(value(plain, "Driver.engaged"), 1.0);
  EXPECT_EQ(plain.release_signal(close), "");
  EXPECT_EQ(forced.release_signal(close), "");
  run(forced, 50);
  run(plain, 50);
  EXPECT_EQ(forced.state_hash(), plain.state_hash());
  forced.reset();
  EXPECT_TRUE(forced.forced_signals().empty());
  run(forced, 1);
  EXPECT_EQ(value(forced, "Driver.engaged"), 0.0);
}

TEST(Signals, DiscreteValuesEnterTheHash) {
  const auto model = model_with("");
  Simulation a(model), b(model);
  ASSERT_TRUE(a.step(std::vector<Command>{driver_speed(a, 1.0)}) && b.step({}));
  EXPECT_NE(a.state_hash(), b.state_hash());
}

TEST(Signals, ValuesThatASignalCannotHaveAreNamed) {
  const SignalDescription flag{"on", "", false, 0.0, 0.0, SignalType::boolean};
  const SignalDescription count{"n", "", false, 0.0, 0.0, SignalType::integer};
  const SignalDescription speed{"v", "rad/s", true, -60.0, 60.0, SignalType::real};
  EXPECT_EQ(wrong_value(flag, 1.0), "");
  EXPECT_THAT(wrong_value(flag, 2.0), HasSubstr("is 2; it is boolean: 0 or 1"));
  EXPECT_EQ(wrong_value(count, 3.0), "");
  EXPECT_THAT(wrong_value(count, 0.5), HasSubstr("a whole number"));
  EXPECT_EQ(wrong_value(speed, -60.0), "");
  EXPECT_THAT(wrong_value(speed, 61.0), HasSubstr("outside [-60, 60] rad/s"));
  EXPECT_THAT(wrong_value(speed, std::nan("")), HasSubstr("finite"));
}

}  // namespace
}  // namespace takt
