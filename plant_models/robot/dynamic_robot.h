#pragma once
// A robot at LoD 2 and 3: the rigid-body dynamics of arm, gripper palm and jaws, moved by drives, loaded by
// the wrenches of its load.
//
// State segment, in this order: q (n), qd (n) of the arm's joints and then the jaws of its grippers (two
// prismatic joints each, left and right), the states z of each drive in joint order, the mechanical work of
// all drives, and the energy that each joint has taken from its supply before losses (n), in J. Friction modes
// are part of z (drive.h), so the segment is the whole state of the robot.
//
// The KinematicRobot and the ParallelGrippers of LoD 1 generate the reference, so set-points, their
// interpolation and the jaws' commanded travel are the same at every level of detail; at LoD 2 the joints
// follow it by the torques of their drives. A jaw is an ideal position servo with a limited force between two
// end stops.
//
// A DynamicRobot writes the motion of arm, palms and jaws: it replaces both the KinematicRobot and the
// ParallelGrippers in the system of equations. As there, the reference point p_WBcm of palms and jaws is
// their origin, whatever their centre of mass.
//
// Const functions share a workspace: one robot is used by one thread. derivatives(), indicators(),
// switch_modes(), jacobian() and output() require `motion` to be that of write_motion(t, x); then the poses
// of the tree are computed once for all of them. No function allocates after construction.
#include <memory>
#include <vector>

#include "plant_models/electrical/robot_power.h"
#include "plant_models/gripper/parallel_gripper.h"
#include "plant_models/mechanics/multibody_tree.h"
#include "plant_models/plant_model.h"
#include "plant_models/robot/drive.h"
#include "plant_models/robot/kinematic_robot.h"

namespace takt {

/// A gripper on the flange: mass and inertia of palm and jaws. The jaws' stroke is that of the
/// ParallelGripper: each from 0 to half the largest width. The end stops are springs of the jaw's mass times
/// the square of five times the servo's frequency.
struct MountedGripper {
  BodyInertia palm;                          ///< in G
  BodyInertia jaw;                           ///< each jaw, in its own frame; needs a mass
  double servo_frequency_rad_per_s = 200.0;  ///< of the jaws' position servo, critically damped
  double max_force_N = std::numeric_limits<double>::infinity();  ///< of each jaw
  /// Of the synchronising gears between the two jaws, critically damped; 0: without.
  double gear_frequency_rad_per_s = 600.0;
};

struct DynamicRobotParameters {
  int robot = -1;                  ///< index into CellMotion::arms
  ArmModel arm;                    ///< kinematics; joints in the order of `links`
  std::vector<BodyInertia> links;  ///< link after each joint, in its frame; the last includes the flange
  Pose X_WR;                       ///< at the start
  Vec3 gravity_W{0.0, 0.0, -9.80665};
  std::vector<MountedGripper> grippers;  ///< same order as the grippers passed to the constructor
  RobotPowerParameters power;
  int mount = -1;  ///< as in KinematicRobotParameters, and X_MR
  Pose X_MR{};
};

class DynamicRobot final : public PlantModel {
 public:
  /// Throws std::invalid_argument for mismatched numbers of links, drives or grippers, or an inertia that is
  /// not physical (see MultibodyTree). `drives`: of the arm's joints. `reference` and `grippers` must outlive
  /// the robot; they hold the discrete state (set-points, jaw targets).
  DynamicRobot(const DynamicRobotParameters& parameters, std::vector<std::unique_ptr<Drive>> drives,
               const KinematicRobot& reference, std::vector<const ParallelGripper*> grippers);
  ~DynamicRobot() override;

  int state_count() const override;
  void initial_state(double* x) const override;  ///< at rest at the reference, drives carry the static load
  /// Segment from physical quantities (switching the level of detail): positions and velocities of arm and
  /// jaws, the drives in equilibrium with them; energies zero. Here without load, and not accelerating.
  void state_from_motion(const double* q, const double* qd, double* x) const;
  /// The same during a motion: the drives accelerate the arm as the reference does at t, and carry the load
  /// of the wrenches on palms and jaws. `motion` is that of q, written by any model.
  void state_from_motion(double t, const double* q, const double* qd, const CellMotion& motion,
                         std::span<const Wrench> wrenches, double* x) const;

  // The torque mode of the reference (KinematicRobot::torque_mode).

  /// A drive that takes torques, of a joint of the arm.
  bool takes_torques(int joint) const;
  /// Torques of the arm's joints that carry the weight of arm, palms and jaws at the positions in x; not that
  /// of a load.
  JointArray weight_torques(const double* x) const;
  /// Position control begins after torque mode: the integral parts of its drives have these torques.
  void begin_position_control(const JointArray& torques, double* x) const;
  /// The mode of the reference has changed, at the same time and state.
  void control_changed() const;

  void write_motion(double t, const double* x, CellMotion& motion) const override;
  void derivatives(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                   double* xdot) const override;
  int indicator_count() const override;
  void indicators(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                  double* g) const override;
  bool switch_modes(double t, double* x, const CellMotion& motion, std::span<const Wrench> wrenches) override;
  double next_time_event(double t) const override;
  void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const override;
  void jacobian(double t, const double* x, const CellMotion& motion, double* values) const override;
  void time_derivative(double t, const double* x, const CellMotion& motion, double* rate) const override;
  /// Velocities of arm and jaws; servos prescribe theirs up to their torque limit. The energies' dependence
  /// on other states is omitted.
  std::unique_ptr<VelocityForm> make_velocity_form() const override;
  /// The scale of the energies is so large that error tests ignore them: no other state depends on them.
  void state_scales(double* scales) const override;

  /// Outputs of one instant (not for the right-hand side).
  struct Output {
    JointArray torque{};  ///< each drive on its joint (N m or N), jaws included
    JointArray acceleration{};
    std::array<DriveSample, kMaxJoints> drives{};
    Wrench flange_load_W;    ///< of gripper and load on the flange, about the flange origin, world axes
    Wrench base_reaction_W;  ///< on the foundation, about the base origin, world axes
    RobotPower power;        ///< without electrical energy: electrical_energy_J()
  };
  Output output(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches) const;

  /// A lower bound of the palm's inertia, as a free body in G, gripper by gripper: every force on the palm
  /// moves this body at least as much as the palm, in any position of the arm and for any drives. It bounds
  /// the frequency of a spring on the palm.
  BodyInertia least_palm_inertia(std::size_t gripper) const;

  const DynamicRobotParameters& parameters() const { return parameters_; }
  int joint_count() const;  ///< arm and jaws
  const MultibodyTree& tree() const;
  const Drive& drive(int joint) const;  ///< jaws included
  int drive_state(int joint) const;     ///< place of its first state in the segment
  /// Place of the mechanical work of all drives; the energies of the joints follow.
  int energy_state() const { return state_count() - 1 - joint_count(); }
  /// Electrical energy (J) that the robot draws in a time h, from the states before and after it: a joint that
  /// gives back more than it takes in this time is a braking axis (RobotPower). Power within it cancels: a
  /// solver's noise does, as it does in the DC link of a drive.
  double electrical_energy_J(double h, const double* before, const double* after) const;

 private:
  struct Impl;
  class Linear;
  DynamicRobotParameters parameters_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt
