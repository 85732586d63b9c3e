#pragma once
// Inside of DynamicRobot, shared by its source files.
#include "plant_models/robot/dynamic_robot.h"

namespace takt {

struct DynamicRobot::Impl {
  /// Result of one evaluation. `holding`: the holding torque of a joint (stuck friction, servo).
  struct Solution {
    std::array<JointReference, kMaxJoints> reference;
    std::array<DriveOutput, kMaxJoints> output;
    JointArray qdd{}, holding{};
    std::array<bool, kMaxJoints> yields{};  ///< a servo at its limit

    /// Of the drive on its joint.
    double torque(int joint, double armature) const {
      const auto i = static_cast<size_t>(joint);
      return output[i].torque - armature * qdd[i] + holding[i];
    }
  };

  Impl(const DynamicRobotParameters& parameters, std::vector<std::unique_ptr<Drive>> arm_drives,
       const KinematicRobot& arm_reference, std::vector<const ParallelGripper*> mounted);

  const double* drive_states(const double* x, int joint) const {
    return x + z_begin[static_cast<size_t>(joint)];
  }
  const Drive& drive(int joint) const { return *drives[static_cast<size_t>(joint)]; }
  int energy_state() const { return states - 1 - joints; }

  /// The base is where its Ground is, and moves with it.
  void stand_on_mount(const CellMotion& motion) {
    if (mount >= 0) set_base(motion.base_on(mount, X_MR));
  }
  void set_base(const BaseMotion& now);
  /// Computes poses and velocities of the tree at x, unless they are up to date.
  void update(const double* x);
  void references(double t, std::array<JointReference, kMaxJoints>& references) const;
  void apply_wrenches(const CellMotion& motion, std::span<const Wrench> wrenches);
  /// Drive states that give the acceleration `qdd` at x (with q and qd) under the applied wrenches and torques.
  void balance_drives(const JointArray& qdd, const JointArray& applied, double* x);
  /// Torque of a device on a joint besides that of the drive.
  double besides_drive(int joint, double applied) const {
    return joint < arm && !drive(joint).passes_applied_torque() ? applied : 0.0;
  }
  /// Force of the end stop on a jaw, along its joint.
  double stop_force(int joint, const double* x) const;
  /// Accelerations and holding torques at (t, x), for the friction modes in x.
  void solve(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
             Solution& solution);
  /// Accelerations of the arm's joints per drive torque, or per prescribed acceleration of a drive, at x;
  /// cached for the last (t, x).
  const MultibodyTree::MassMatrix& arm_gain(double t, const double* x);
  /// Power that a joint takes from its supply, or gives back if negative, before losses: of its motor, else mechanical.
  double taken(int joint, const DriveOutput& output, double mechanical_W) const {
    return drive(joint).has_motor() ? output.electrical_power_W : mechanical_W;
  }
  /// The same as the supply sees it; power, or the energy of a while.
  double supplied(const RobotPowerParameters& power, int joint, double taken) const {
    return drive(joint).has_motor() ? electrical_power_of_motor(power, taken)
                                    : electrical_power_of_axis(power, taken);
  }

  const KinematicRobot& reference;
  std::vector<const ParallelGripper*> grippers;
  std::vector<std::unique_ptr<Drive>> drives;  ///< arm, then jaws
  MultibodyTree tree;
  BaseMotion base;
  int mount = -1;
  Pose X_MR;
  Vec3 gravity_W;
  std::size_t robot = 0;                ///< index into CellMotion::arms
  int arm = 0, joints = 0, states = 0;  ///< moving joints of the arm, with jaws, length of the segment
  std::array<int, kMaxJoints> z_begin{};
  std::array<DrivePattern, kMaxJoints> patterns;
  int indicators = 0;
  struct EndStop {
    double upper_m = 0.0;
    double stiffness_N_per_m = 0.0, damping_N_s_per_m = 0.0;
  };
  std::array<EndStop, kMaxJoints> stops{};
  /// The synchronising gears between the two jaws of a gripper, active as far as their references are equal:
  /// a held Part does not float if both drives are at their limit. Stored at the place of the left jaw.
  struct Sync {
    double stiffness_N_per_m = 0.0, damping_N_s_per_m = 0.0;
  };
  std::array<Sync, kMaxJoints> syncs{};
  int other_jaw(int joint) const { return (joint - arm) % 2 == 0 ? joint + 1 : joint - 1; }
  const Sync& sync(int joint) const {
    return syncs[static_cast<size_t>((joint - arm) % 2 == 0 ? joint : joint - 1)];
  }
  /// Force of those gears on a jaw, along its joint.
  double sync_force(int joint, const double* x, const std::array<JointReference, kMaxJoints>& wanted) const;

  MultibodyTree::Workspace w;
  JointArray q{}, qd{};  ///< of which `w` holds the poses
  bool updated = false;
  Solution solution;
  MultibodyTree::MassMatrix gain;  ///< at (gain_t, gain_x)
  double gain_t = std::numeric_limits<double>::quiet_NaN();
  std::array<bool, kMaxJoints> yielding{};  ///< at (yielding_t, yielding_x), found while linearising there
  double yielding_t = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> yielding_x;
  std::vector<double> gain_x;
};

}  // namespace takt
