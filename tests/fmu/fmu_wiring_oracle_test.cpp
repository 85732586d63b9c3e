// FMUs as drives of joints and as heat sources, wired in scenarios, against closed forms of the coupled system and against
// the equations of both sides, stepped here with the same exchange.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "tests/support/device_cell.h"
#include "tests/support/fmu_cell.h"

namespace takt::test {
namespace {

using testing::HasSubstr;

const double kR = 1.0, kL = 0.01, kK = 0.1;  // of the winding
constexpr double kVoltage = 12.0, kGear = 20.0, kLink = 0.04, kArmature = 0.01;

/// `text` without its first lines; WINDING stands for the FMU.
std::shared_ptr<const CellModel> cell_with_fmus(std::string text) {
  const TemporaryDirectory directory;
  directory.write(
      "axis.urdf",
      "<robot name='axis'><link name='base'/><link name='arm'><inertial><mass value='1'/>"
      "<inertia ixx='0.04' iyy='0.04' izz='0.04' ixy='0' ixz='0' iyz='0'/></inertial></link>"
      "<joint name='turn' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/>"
      "<limit lower='-1000' upper='1000' velocity='100' effort='100'/></joint></robot>");
  for (const auto& [word, path] : {std::pair<std::string, std::string>{"WINDING", kTestFmus / "winding.fmu"},
                                   {"MESHES", std::string(TAKT_CONFIG_DIR) + "/meshes"}})
    for (auto at = text.find(word); at != std::string::npos; at = text.find(word))
      text.replace(at, word.size(), path);
  directory.write("cell.yaml", "takt_scenario: 1\nname: wired\n" + text);
  FmuLibrary library(kTestFmus, kFmuHost);
  ImportOptions import;
  import.fmus = &library;
  return load_cell(directory / "cell.yaml", {}, import);
}

std::string axis(double step_s, const std::string& torque, const std::string& more, int level = 2,
                 const std::string& solver = "") {
  return "solver: {step_s: " + std::to_string(step_s) + solver +
         "}\nprocesses: {all: {level_of_detail: " + std::to_string(level) +
         ", members: all}}\nrobots:\n  Robot1: {urdf: axis.urdf, base_link: base, flange_link: arm, "
         "initial_joints_rad: [0]}\njoint_torques: {Axis: {robot: Robot1, joint: turn" +
         torque + "}}\n" + more;
}

std::string motor_axis(double step_s, const std::string& solver = "") {
  return axis(step_s, ", armature_kg_m2: 0.01",
              "fmus: {Winding: {file: WINDING, start: {u: 12}}}\n"
              "wires:\n  Winding.w: 20 * Axis.velocity\n  Axis.torque: 20 * Winding.tau\n",
              2, solver);
}

/// Speed of the joint after the voltage comes on: L J w'' + R J w' + (n k)^2 w = n k u.
double motor_speed(double t) {
  const double J = kLink + kArmature, nk = kGear * kK;
  const double a = kR / kL, b = nk * nk / (kL * J);
  const std::complex<double> root = std::sqrt(std::complex<double>(a * a / 4.0 - b));
  const std::complex<double> p = -a / 2.0 + root, q = -a / 2.0 - root;
  const double end = kVoltage / nk;
  const std::complex<double> A = q * end / (p - q), B = -end - A;
  return (end + A * std::exp(p * t) + B * std::exp(q * t)).real();
}

/// Largest difference to the closed form within 0.2 s.
double largest_difference(double step_s) {
  DeviceCell cell(cell_with_fmus(motor_axis(step_s)));
  double difference = 0.0;
  for (int i = 1; i * step_s <= 0.2; ++i) {
    if (!cell.step()) break;
    difference = std::max(difference, std::abs(cell.read("Axis", "velocity") - motor_speed(i * step_s)));
  }
  return difference;
}

TEST(FmuDrive, TheJointRunsUpAsTheClosedFormOfTheMotorSays) {
  const double coarse = largest_difference(4e-4), fine = largest_difference(1e-4);
  // Both sides hold what they get over a step, so the difference is of first order in the step.
  EXPECT_LT(fine, 0.01 * kVoltage / (kGear * kK));
  EXPECT_NEAR(coarse / fine, 4.0, 0.3);
}

/// Solvers of all kinds, with the error of the position that each is allowed.
class FmuDriveSolver : public testing::TestWithParam<std::pair<const char*, double>> {};
INSTANTIATE_TEST_SUITE_P(All, FmuDriveSolver,
                         testing::Values(std::pair(", method: rk2", 1e-9), std::pair(", method: rk4", 1e-9),
                                         std::pair(", method: rosenbrock", 1e-9),
                                         std::pair(", method: cvode, tolerance: 1.0e-9", 1e-6),
                                         std::pair(", method: rk2, dynamics: {method: implicit}", 5e-3)));

TEST_P(FmuDriveSolver, FmuAndJointExchangeTheirValuesAtEachStep) {
  constexpr double h = 1e-3;
  const auto [solver, error] = GetParam();
  const double tolerance = std::min(error, 1e-6);
  DeviceCell cell(cell_with_fmus(motor_axis(h, solver)));
  double current = 0.0, speed = 0.0, angle = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double acceleration = kGear * kK * current / (kLink + kArmature);
    const double end = (kVoltage - kK * kGear * speed) / kR;
    current = end + (current - end) * std::exp(-kR / kL * h);
    angle += speed * h + 0.5 * acceleration * h * h, speed += acceleration * h;
    ASSERT_TRUE(cell.step());
    ASSERT_NEAR(cell.read("Winding", "i"), current, tolerance) << i;
    ASSERT_NEAR(cell.read("Axis", "velocity"), speed, tolerance) << i;
    ASSERT_NEAR(cell.read("Axis", "position"), angle, error) << i;
  }
  EXPECT_NEAR(cell.now().robots[0].velocity[0], speed, tolerance);
}

TEST(FmuDrive, ASavedStateGoesOnWithTheSameBits) {
  const auto model = cell_with_fmus(motor_axis(1e-3));
  DeviceCell one(model), other(model);
  one.run(0.05);
  std::vector<std::byte> state;
  ASSERT_EQ(one.simulation().save_state(state), "");
  one.run(0.05);
  ASSERT_EQ(other.simulation().restore_state(state), "");
  other.run(0.05);
  EXPECT_EQ(other.simulation().state_hash(), one.simulation().state_hash());
  EXPECT_GT(one.read("Axis", "velocity"), 1.0);
}

TEST(JointTorque, IsLimitedByTheEffortOfTheJointOrAsStated) {
  DeviceCell cell(cell_with_fmus(axis(1e-3, "", "")));
  const SignalDescription& signal = cell.description().devices[0].signals[0];
  EXPECT_EQ(signal.upper, 100.0);
  EXPECT_EQ(signal.unit, "N m");
  const auto limited = cell_with_fmus(axis(1e-3, ", max_torque_N_m: 5", ""));
  EXPECT_EQ(limited->description.devices[0].signals[0].lower, -5.0);
}

TEST(JointTorque, IsTheTorqueOfTheDriveThatItReplaces) {
  DeviceCell cell(cell_with_fmus(axis(1e-3, "", "")));
  cell.set("Axis", "torque", 0.08);
  cell.run(0.5);
  // 0.08 N m on 0.04 kg m^2; set-points of the robot do not matter.
  EXPECT_NEAR(cell.read("Axis", "velocity"), 1.0, 1e-9);
  EXPECT_NEAR(cell.read("Axis", "position"), 0.25, 1e-9);
  const RobotSample& robot = cell.now().robots[0];
  EXPECT_NEAR(robot.effort[0], 0.08, 1e-12);
  EXPECT_NEAR(robot.power.mechanical_energy_J, 0.5 * kLink, 1e-9);
}

TEST(JointTorque, BesidesTheDriveIsCarriedByTheDrive) {
  DeviceCell cell(cell_with_fmus(axis(1e-3, ", drive: kept", "")));
  cell.set("Axis", "torque", 3.0);
  cell.run(0.02);
  EXPECT_GT(std::abs(cell.read("Axis", "position")), 1e-4);  // the drive yields at first
  cell.run(2.0);
  EXPECT_NEAR(cell.read("Axis", "position"), 0.0, 1e-6);
  EXPECT_NEAR(cell.now().robots[0].effort[0], -3.0, 1e-4);
}

TEST(JointTorque, WaitsForLevelOfDetailTwo) {
  const auto model = cell_with_fmus(axis(1e-3, "", "", 1));
  std::string notes;
  for (const ImportNote& note : model->import_notes) notes += note.sentence;
  EXPECT_THAT(notes, HasSubstr("Robot1 is at level of detail 1"));
  DeviceCell cell(model);
  cell.set("Axis", "torque", 1.0);
  cell.run(0.1);
  EXPECT_EQ(cell.read("Axis", "position"), 0.0);
  ASSERT_EQ(cell.simulation().set_level_of_detail(0, 2), "");
  cell.run(0.1);
  EXPECT_NEAR(cell.read("Axis", "velocity"), 0.1 / kLink, 1e-9);
}

std::string refused(const std::string& text) {
  try {
    cell_with_fmus(text);
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(JointTorque, WrongJointsAreRefused) {
  EXPECT_THAT(refused(axis(1e-3, "2", "")), HasSubstr("found 'turn2'; allowed: a joint of Robot1: turn"));
  EXPECT_THAT(refused(axis(1e-3, "}, Axis2: {robot: Robot1, joint: turn", "")),
              HasSubstr("found 'turn' of Robot1 again; allowed: one torque for each joint"));
  EXPECT_THAT(refused(axis(1e-3, ", drive: kept, armature_kg_m2: 1", "")), HasSubstr("armature_kg_m2"));
}

/// A Part of 1000 J/K without weight, heated by the losses of a winding.
std::string heated(const std::string& heat, const std::string& more) {
  return "solver: {step_s: 0.001}\nworld: {gravity_m_per_s2: [0, 0, 0], temperature_degC: 20}\n"
         "parts: {Core: {mesh: MESHES/O.obj, hierarchy: 1, mass_kg: 2, heat: {specific_heat_J_per_kg_K: 500" +
         heat + "}}}\nheat_sources: {Heater: {part: Core}}\n" + more;
}
const std::string kWindingHeats =
    "fmus: {Winding: {file: WINDING, start: {u: 10}}}\nwires: {Heater.heat: Winding.heat}\n";

TEST(FmuHeatSource, WarmsOneHeatCapacityAsItsClosedFormSays) {
  DeviceCell cell(cell_with_fmus(heated("", kWindingHeats)));
  // i = (u / R) (1 - exp(-t / T)), T = L / R: the heat is the integral of R i^2.
  const double T = kL / kR, power = 100.0 / kR;
  double held = 0.0;
  for (int i = 1; i <= 500; ++i) {
    const double before = 1e-3 * (i - 1), t = 1e-3 * i;
    held += 1e-3 * power * std::pow(1.0 - std::exp(-before / T), 2.0);
    ASSERT_TRUE(cell.step());
    ASSERT_NEAR(cell.read("Heater", "delivered"), held, 1e-9) << i;
    ASSERT_NEAR(cell.read("Core_heat", "temperature"), 20.0 + held / 1000.0, 1e-9) << i;
    const double exact =
        power * (t - 2.0 * T * (1.0 - std::exp(-t / T)) + 0.5 * T * (1.0 - std::exp(-2.0 * t / T)));
    ASSERT_NEAR(held, exact, 1e-3 * power) << i;  // held over a step of 1 ms
  }
  EXPECT_NEAR(cell.read("Core_heat", "heat_flow"), power, 1e-6);
}

TEST(FmuHeatSource, SettlesWhereTheCoolingTakesTheHeat) {
  DeviceCell cell(cell_with_fmus(heated(
      ", temperature_degC: 20, surface_m2: 0.5, cooling_W_per_m2_K: 2000",
      "fmus: {Winding: {file: WINDING, start: {u: 100, i: 100}}}\nwires: {Heater.heat: Winding.heat}\n")));
  // C dT/dt = P - h A (T - 20): 1000 J/K, 10 kW, 1000 W/K.
  for (int i = 1; i <= 3000; ++i) {
    ASSERT_TRUE(cell.step());
    ASSERT_NEAR(cell.read("Core_heat", "temperature"), 30.0 - 10.0 * std::exp(-1e-3 * i), 1e-6) << i;
  }
}

TEST(HeatSource, AsksForAPartWithATemperature) {
  EXPECT_THAT(refused("parts: {Core: {mesh: MESHES/O.obj, hierarchy: 1, mass_kg: 2}}\nheat_sources: {Heater: "
                      "{part: Core}}\n"),
              HasSubstr("found 'Core', which has no temperature; allowed: a part with the key heat"));
}

}  // namespace
}  // namespace takt::test
