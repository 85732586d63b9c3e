// Torques of joints without position control, against closed forms: a constant torque accelerates evenly, none leaves
// momentum and rest, and its work is the kinetic energy, by a second implementation of the dynamics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/geared_drives.h"
#include "tests/support/kdl_tree.h"
#include "tests/support/service_cell.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

constexpr double kLever_m = 0.5, kMass_kg = 1.0, kLinkInertia = 0.04, kStart_rad = 0.4;
constexpr double kStep_s = 0.001;

struct Axis {
  std::string name, drives;
  double armature;
  double tolerance;  ///< of the way, as a share: the current follows its reference with a lag
};

/// One link on one joint.
class OneAxis : public testing::TestWithParam<std::tuple<Axis, int>> {
 protected:
  std::unique_ptr<Simulation> simulation(const std::string& axis) const {
    const TemporaryDirectory directory;
    directory.write("axis.urdf",
                    "<robot name='axis'><link name='base'/><link name='arm'><inertial><origin xyz='0.5 0 0'/>"
                    "<mass value='1'/><inertia ixx='0.04' iyy='0.04' izz='0.04' ixy='0' ixz='0' iyz='0'/>"
                    "</inertial></link><joint name='turn' type='revolute'><parent link='base'/>"
                    "<child link='arm'/><axis xyz='" +
                        axis +
                        "'/><limit lower='-100' upper='100' velocity='50' effort='100'/></joint></robot>");
    directory.write("cell.yaml",
                    "takt_scenario: 1\nname: axis\nsolver: {step_s: " + std::to_string(kStep_s) +
                        ", method: cvode, tolerance: 1.0e-9}\nprocesses: {all: {level_of_detail: " +
                        std::to_string(std::get<1>(GetParam())) +
                        ", members: all}}\ncontact: {defaults: {friction: 0.3}}\nrobots:\n  Robot1: {urdf: "
                        "axis.urdf, base_link: base, flange_link: arm, initial_joints_rad: [0.4], drives: {" +
                        std::get<0>(GetParam()).drives + "}}\n");
    auto result = std::make_unique<Simulation>(load_cell(directory / "cell.yaml"));
    EXPECT_EQ(result->make_snapshot().robots[0].level_of_detail, std::get<1>(GetParam()));
    return result;
  }
  static Command torque(double value) {
    JointCommand command;
    command.robot = 0;
    command.has_effort = command.torque_mode = true;
    command.effort[0] = value;
    return command;
  }
  static RobotSample step(Simulation& simulation, const std::vector<Command>& commands = {}) {
    EXPECT_TRUE(simulation.step(commands)) << simulation.fault();
    return simulation.make_snapshot().robots[0];
  }
  double inertia() const {
    return kLinkInertia + kMass_kg * kLever_m * kLever_m + std::get<0>(GetParam()).armature;
  }
};

TEST_P(OneAxis, AConstantTorqueAcceleratesEvenly) {
  constexpr double kTorque_N_m = 2.0;
  for (const char* axis : {"0 0 1", "0 1 0"}) {  // the weight of the second one is carried
    const auto cell = simulation(axis);
    RobotSample robot = step(*cell, {torque(kTorque_N_m)});
    while (cell->step_index() < 500) robot = step(*cell);
    const double t = cell->time_s(), way = 0.5 * kTorque_N_m / inertia() * t * t;
    // The weight is carried at the position where each step begins.
    const double room = (std::get<0>(GetParam()).tolerance + (axis[2] == '1' ? 0.01 : 1e-9)) * way;
    EXPECT_NEAR(robot.position[0] - kStart_rad, way, room) << axis;
    EXPECT_NEAR(robot.velocity[0], kTorque_N_m / inertia() * t, 2.0 * room / t) << axis;
    // The robot stays where a position command takes it to, from where it is.
    JointCommand stop;
    stop.robot = 0;
    stop.has_velocity = true;
    stop.period_s = 0.5;
    stop.position[0] = robot.position[0] + 0.25 * robot.velocity[0];
    const double before = robot.position[0], speed = robot.velocity[0];
    robot = step(*cell, {stop});
    EXPECT_NEAR(robot.position[0], before + kStep_s * speed, 0.05 * kStep_s * speed) << axis;
    for (int i = 0; i < 3000; ++i) robot = step(*cell);
    EXPECT_NEAR(robot.position[0], stop.position[0], 1e-4) << axis;
    EXPECT_NEAR(robot.velocity[0], 0.0, 1e-4) << axis;
  }
}

TEST_P(OneAxis, WithoutTorqueMomentumAndRestStay) {
  for (const char* axis : {"0 0 1", "0 1 0"}) {
    const auto cell = simulation(axis);
    RobotSample robot = step(*cell, {torque(0.0)});
    while (cell->step_index() < 1000) robot = step(*cell);
    EXPECT_NEAR(robot.position[0], kStart_rad, 1e-7) << axis;
  }
  const auto cell = simulation("0 0 1");
  step(*cell, {torque(3.0)});
  while (cell->step_index() < 100) step(*cell);
  step(*cell, {torque(0.0)});
  RobotSample robot;
  while (cell->step_index() < 150) robot = step(*cell);  // the current has gone
  const double speed = robot.velocity[0];
  EXPECT_GT(speed, 0.1);
  while (cell->step_index() < 1000) robot = step(*cell);
  EXPECT_NEAR(robot.velocity[0], speed, std::max(1e-3, std::get<0>(GetParam()).tolerance) * speed);
}

const Axis kIdeal{"ideal", "model: ideal", 0.0, 1e-6};
const Axis kSimplified{"simplified", "model: simplified, gear_ratio: 50, motor_inertia_kg_m2: 4.0e-5", 0.1,
                       1e-6};
const Axis kDetailed{
    "detailed",
    "model: detailed, gear_ratio: 50, motor_inertia_kg_m2: 4.0e-5, torque_constant_N_m_per_A: "
    "0.5, current_loop_rad_per_s: 5000, current_loop_damping: 0.6, armature_resistance_ohm: 250, "
    "power_stage_gain: 5, friction: none, position_gain_per_s: 5, speed_gain_A_s_per_rad: 1, "
    "speed_integral_time_s: 0.05",
    0.1, 0.02};
INSTANTIATE_TEST_SUITE_P(
    Drives, OneAxis, testing::Combine(testing::Values(kIdeal, kSimplified, kDetailed), testing::Values(2, 3)),
    [](const auto& test) { return std::get<0>(test.param).name + std::to_string(std::get<1>(test.param)); });

/// Six axes and a gripper at level of detail 2.
class SixAxes : public testing::Test {
 protected:
  SixAxes() {
    add_rotors(*model_);
    simulation_ = std::make_unique<Simulation>(model_);
    EXPECT_EQ(simulation_->set_level_of_detail(-1, 2), "");
  }
  static Command torques(const JointArray& values) {
    JointCommand command;
    command.robot = 0;
    command.has_effort = command.torque_mode = true;
    command.effort = values;
    return command;
  }
  RobotSample run(const JointArray& values, int steps) {
    const std::vector<Command> commands{torques(values)};
    for (int i = 0; i < steps; ++i)
      EXPECT_TRUE(simulation_->step(i == 0 ? commands : std::vector<Command>{})) << simulation_->fault();
    return simulation_->make_snapshot().robots[0];
  }
  /// Kinetic energy of the robot and its rotors by KDL, jaws at rest against the palm.
  double kinetic_energy_J(const RobotSample& robot) const {
    const RobotDynamics& dynamics = *model_->dynamics[0];
    const std::size_t n = dynamics.parameters.links.size();
    std::vector<ParallelGripper> grippers{ParallelGripper(model_->grippers[0].parameters)};
    const KinematicRobot reference(model_->robots[0]);
    const DynamicRobot dynamic(dynamics.parameters, make_drives(dynamics.drives), reference, {&grippers[0]});
    const TreeModel& tree = dynamic.tree().model();
    const KDL::Tree other = kdl_tree(tree);
    KDL::TreeIdSolver_RNE solver(other, KDL::Vector::Zero());
    const std::vector<unsigned> number = kdl_numbers(tree, other);
    const auto joints = static_cast<unsigned>(tree.joint_count());
    KDL::JntArray q(joints), rest(joints), qd(joints), momentum(joints);
    for (std::size_t i = 0; i < joints; ++i) {
      q(number[i]) =
          i < n ? robot.position[i]
                : grippers[0].coordinate(0.0, i == n ? ParallelGripper::left : ParallelGripper::right);
      qd(number[i]) = i < n ? robot.velocity[i] : 0.0;
    }
    EXPECT_GE(solver.CartToJnt(q, rest, qd, {}, momentum), 0);
    double energy = 0.0;
    for (std::size_t i = 0; i < n; ++i)
      energy += 0.5 * robot.velocity[i] * (momentum(number[i]) + tree.joints[i].armature * robot.velocity[i]);
    return energy;
  }

  std::shared_ptr<CellModel> model_ = service_model();
  std::unique_ptr<Simulation> simulation_;
};

TEST_F(SixAxes, WithoutTorquesTheArmStays) {
  const RobotSample before = simulation_->make_snapshot().robots[0];
  const RobotSample after = run({}, 1000);
  for (std::size_t j = 0; j < 6; ++j) EXPECT_NEAR(after.position[j], before.position[j], 1e-9) << j;
}

// The work of constant torques is torque times way.
TEST_F(SixAxes, TheWorkOfTorquesIsKineticEnergy) {
  const RobotSample before = simulation_->make_snapshot().robots[0];
  const JointArray values{25.0, 30.0, -12.0, 3.0, -2.0, 1.5};
  const RobotSample after = run(values, 250);
  double work = 0.0;
  for (std::size_t j = 0; j < 6; ++j) work += values[j] * (after.position[j] - before.position[j]);
  EXPECT_GT(work, 2.0);
  EXPECT_NEAR(kinetic_energy_J(after), work, 0.01 * work);
  EXPECT_GT(std::abs(after.position[1] - before.position[1]), 0.02);
}

}  // namespace
}  // namespace takt::test
