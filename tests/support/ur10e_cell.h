#pragma once
// A UR10e with a parallel gripper of 3 kg as a DynamicRobot, its drives chosen by the test.
#include "plant_models/robot/ideal_servo.h"
#include "plant_models/robot/simplified_drive.h"
#include "tests/support/constants.h"
#include "tests/support/robot_bench.h"
#include "tests/support/robot_tables.h"

namespace takt::test {

inline JointArray ready_position() {
  JointArray q{};
  q[0] = 0.3, q[1] = -1.4, q[2] = 1.7, q[3] = -1.1, q[4] = -1.5, q[5] = 0.4;
  return q;
}

inline ArmModel ur10e_arm() {
  ArmModel arm;
  for (const TreeJoint& joint : tree_of(ur10e_table()).joints) arm.joints.push_back(joint.joint);
  return arm;
}

inline KinematicRobotParameters ur10e_reference(const Pose& X_WR) {
  KinematicRobotParameters p;
  p.robot = 0;
  p.arm = ur10e_arm();
  p.X_WR = X_WR;
  p.q_initial = ready_position();
  return p;
}

inline ParallelGripperParameters gripper_parameters() {
  ParallelGripperParameters p;
  p.robot = 0, p.palm = 0, p.jaws = {1, 2};
  p.X_FG.p = {0.0, 0.01, 0.1};
  p.X_FG.R = rotation_from_rpy({0.0, 0.0, 0.5});
  p.max_width_m = 0.085, p.initial_width_m = 0.06, p.jaw_speed_m_per_s = 0.075;
  return p;
}

inline MountedGripper gripper_masses() {
  MountedGripper g;
  g.servo_frequency_rad_per_s = 100.0;
  g.gear_frequency_rad_per_s = 0.0;  // each jaw by itself: closed forms
  g.palm = {2.8, {0.0, 0.01, -0.03}, Vec3(4e-3, 5e-3, 6e-3).asDiagonal()};
  g.jaw = {0.1, {0.0, 0.01, 0.02}, Vec3(2e-5, 3e-5, 4e-5).asDiagonal()};
  g.max_force_N = 60.0;
  return g;
}

inline Pose base_pose() {
  return {rotation_from_rpy({0.0, 0.0, 0.7}), {0.2, -0.4, 0.9}};
}

using DriveMaker = std::unique_ptr<Drive> (*)(int joint);

inline std::unique_ptr<Drive> ideal_servo(int) {
  return std::make_unique<IdealServo>(IdealServoParameters{});
}

/// Rotors behind harmonic drives, assumed: 1 kg m^2 at the large joints, 0.1 kg m^2 at the wrist.
inline std::unique_ptr<Drive> simplified_drive(int joint) {
  SimplifiedDriveParameters p;
  p.gear_ratio = 100.0;
  p.rotor_inertia_kg_m2 = joint < 3 ? 1e-4 : 1e-5;
  p.load_inertia_kg_m2 = joint < 2 ? 8.0 : (joint == 2 ? 2.0 : 0.1);
  p.set_bandwidth(40.0);
  return std::make_unique<SimplifiedDrive>(p);
}

/// Reference, gripper, robot and bench.
struct Ur10eCell {
  explicit Ur10eCell(DriveMaker make, const Pose& X_WR = base_pose(), double max_force_N = 60.0,
                     const RobotPowerParameters& power = {})
      : reference(ur10e_reference(X_WR)), gripper(gripper_parameters()) {
    DynamicRobotParameters p;
    p.robot = 0;
    p.arm = ur10e_arm();
    for (const TreeJoint& joint : tree_of(ur10e_table()).joints) p.links.push_back(joint.inertia);
    p.X_WR = X_WR;
    p.gravity_W = {0.0, 0.0, -kGravity_m_s2};
    p.grippers.push_back(gripper_masses());
    p.grippers[0].max_force_N = max_force_N;
    p.power = power;
    std::vector<std::unique_ptr<Drive>> drives;
    for (int i = 0; i < 6; ++i) drives.push_back(make(i));
    robot = std::make_unique<DynamicRobot>(p, std::move(drives), reference,
                                           std::vector<const ParallelGripper*>{&gripper});
    bench = std::make_unique<RobotBench>(*robot, 3);
  }

  KinematicRobot reference;
  ParallelGripper gripper;
  std::unique_ptr<DynamicRobot> robot;
  std::unique_ptr<RobotBench> bench;
};

}  // namespace takt::test
