#pragma once
// The plant models of a running cell, at the present level of detail of each robot, as one state vector with
// its solver.
//
// Every robot always has its kinematic model, which turns set-points into reference motion. At LoD 1 the
// joints follow the reference exactly; above, a DynamicRobot tracks it and also moves palm and jaws of its
// grippers. The states are: dynamic robots in order, auxiliary models, then 13 for each Part. A change of a
// robot's level rebuilds the state vector between two steps from physical quantities (poses, joint positions
// and velocities), so no quantity jumps. It allocates, as loading does; steps do not.
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "plant_models/device_model.h"
#include "plant_models/ground_carrier.h"
#include "plant_models/mechanics/fixed_body.h"
#include "plant_models/robot/dynamic_robot.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/signals.h"
#include "server/simulation/solver/integrator.h"
#include "server/simulation/solver/ode_system.h"

namespace takt {

/// Present values of the signals of grippers and robots.
class MachineSignals {
 public:
  virtual ~MachineSignals() = default;
  virtual double value(SignalRef ref) const = 0;
};

class CellPlant {
 public:
  /// All outlive the plant. `contacts`: surface contact, where the cell has it.
  CellPlant(const CellModel& model, const ComponentInteraction& interaction,
            ContactInteraction* contacts = nullptr);

  /// Initial state at the levels the cell was loaded with.
  void reset();
  int level(std::size_t robot) const { return levels_[robot]; }
  bool can_be_dynamic(std::size_t robot) const { return dynamic_[robot] != nullptr; }
  /// Sets the level of each robot, between two steps at time t. The motion must be that of (t, state()).
  /// Drives start in equilibrium with the robot's motion and load; energies continue from their last values.
  void change_levels(std::span<const int> levels, double t);

  /// Saves levels, discrete state of the models, states and the solver's memory. Saving restarts solvers that
  /// hide their memory (Integrator::hides_history), and allocates then. Before load() the saved contacts must
  /// act; load() throws StateError, and the plant must then be discarded.
  void save(StateWriter& out);
  void load(StateReader& in);
  /// Puts a Part (index among Parts) elsewhere, between two steps.
  void put_part(std::size_t part, const Pose& X_WB, const Twist& V_WB);

  /// The solver in use.
  const SolverParameters& solver() const;
  bool any_dynamic() const;
  OdeSystem& system() { return *system_; }
  const OdeSystem& system() const { return *system_; }
  Integrator& integrator() { return *integrator_; }
  std::vector<double>& state() { return x_; }
  const std::vector<double>& state() const { return x_; }
  /// The last accepted state, where a step that fails goes back to.
  const std::vector<double>& accepted() const { return accepted_; }
  void keep_accepted();
  /// Discrete, when the step of length h from accepted() to state() is accepted: the energy that robots have drawn.
  void count_energy(double h);
  /// Index of a Part's first state (index among Parts), and the name of a state, for error texts.
  std::size_t part_begin(std::size_t part) const { return parts_begin_ + part * RigidBody::kStates; }
  std::size_t parts_begin() const { return parts_begin_; }
  std::span<const ForceElement* const> force_elements() const { return force_elements_; }
  /// The models that move Grounds or their surfaces, in the order of their motion.
  std::span<GroundCarrier* const> carriers() const { return carriers_; }
  /// By component: a Ground that may move, or whose surface may; empty without carriers.
  const std::vector<char>& movable_grounds() const { return movable_; }
  /// Discrete, after the commands of a step at time t: by component, whether it is a Ground that moves in this step, or whose
  /// surface does. Empty without carriers.
  const std::vector<char>& find_moving_grounds(double t);
  std::span<const double> auxiliary_states() const {
    return std::span<const double>(x_).subspan(auxiliary_begin_, parts_begin_ - auxiliary_begin_);
  }
  /// By its index among the cell's devices.
  DeviceModel& device(std::size_t index) { return *devices_[index].first; }
  /// Present values with forced ones in place of others.
  void read_signals(std::size_t device, double t, std::span<double> signals) const;
  /// Present value of any signal of the cell (signals.h), forced ones included: for all that read a signal of another
  /// device. `device` counts devices, then grippers, then robots.
  double signal(int device, int signal) const { return signal_value({device, signal}); }
  double signal_value(SignalRef ref) const;
  /// In the order of the references.
  std::span<const ForcedSignal> forced_signals() const { return forced_; }
  /// Null where the signal is not forced.
  ForcedSignal* forced(SignalRef ref);
  void force(const ForcedSignal& signal);
  void release(SignalRef ref);
  /// The time at which signals are read, and the reader of those of grippers and robots.
  void set_time(double t) { now_s_ = t; }
  double time() const { return now_s_; }
  void set_machine_signals(const MachineSignals* machines) { machines_ = machines; }
  /// Between two steps: discrete decisions of auxiliary models (PlantModel::decide). The motion must be that
  /// of (t, state()); true if the decisions have changed it.
  bool decide(double t);
  std::string describe_state(std::size_t state) const;

  /// False while a safety device stops the cell: no device may set anything in motion. Grippers hold.
  bool motion_allowed() const { return motion_allowed_; }
  void allow_motion(bool allowed) {
    motion_allowed_ = allowed;
    for (GroundCarrier* carrier : carriers_) carrier->allow_motion(now_s_, allowed);
  }
  /// Share of its time that a trajectory advances by, 0 to 1.
  double speed_override() const { return speed_override_; }
  void set_speed_override(double share) { speed_override_ = share; }

  std::vector<KinematicRobot>& robots() { return robots_; }
  const std::vector<KinematicRobot>& robots() const { return robots_; }
  std::vector<ParallelGripper>& grippers() { return grippers_; }
  const std::vector<ParallelGripper>& grippers() const { return grippers_; }
  /// The dynamic model of a robot, or null at LoD 1.
  const DynamicRobot* dynamic(std::size_t robot) const {
    return levels_[robot] > 1 ? dynamic_[robot].get() : nullptr;
  }
  /// Outputs of a robot above LoD 1 under these wrenches, with the energy of the last accepted step. `motion`: of (t, state()).
  DynamicRobot::Output robot_output(std::size_t robot, double t, const CellMotion& motion,
                                    std::span<const Wrench> wrenches) const;
  /// Masses and inertias of a robot and its grippers, or null where the scenario has no dynamics.
  const DynamicRobotParameters* dynamics(std::size_t robot) const {
    return dynamic_[robot] != nullptr ? &dynamic_[robot]->parameters() : nullptr;
  }
  /// Its segment of the state vector.
  std::span<const double> segment(std::size_t robot) const;
  std::span<double> segment(std::size_t robot) {
    const std::span<const double> found = std::as_const(*this).segment(robot);
    return std::span<double>(x_).subspan(segment_begin_[robot], found.size());
  }
  /// Measured distance of a jaw's grip face from the centre (m).
  double jaw_coordinate(std::size_t gripper, ParallelGripper::Side side, double t) const;
  /// Its derivative (m/s).
  double jaw_speed(std::size_t gripper, ParallelGripper::Side side, double t) const;
  double width(std::size_t gripper, double t) const {
    return jaw_coordinate(gripper, ParallelGripper::left, t) +
           jaw_coordinate(gripper, ParallelGripper::right, t);
  }
  /// Place of a jaw among the joints of the dynamic model of its robot.
  std::size_t jaw_joint(std::size_t gripper, ParallelGripper::Side side) const {
    return jaw_joint(gripper_place_[gripper].first, gripper_place_[gripper].second, side);
  }
  /// DynamicRobot::least_palm_inertia() of the robot that carries this gripper; std::nullopt at LoD 1.
  std::optional<BodyInertia> least_palm_inertia(std::size_t gripper) const;
  /// Clock for the computing time of the wrenches, optional; kept when the system is rebuilt.
  void set_clock(double (*now_s)());

 private:
  void build();
  void order_carriers();
  std::size_t jaw_joint(std::size_t robot, std::size_t place, ParallelGripper::Side side) const;

  const CellModel& model_;
  const ComponentInteraction& interaction_;
  ContactInteraction* contacts_;
  std::vector<KinematicRobot> robots_;
  std::vector<ParallelGripper> grippers_;
  std::vector<std::unique_ptr<PlantModel>> auxiliary_;
  std::vector<const ForceElement*> force_elements_;            ///< the force elements among auxiliary_
  std::vector<std::pair<DeviceModel*, std::size_t>> devices_;  ///< by device: model, place among auxiliary_
  std::vector<PlantModel*> carrier_models_;                    ///< of carriers_, ahead of all other models
  std::vector<GroundCarrier*> carriers_;
  std::vector<char> movable_, moving_;  ///< by component
  std::vector<FixedBody> grounds_;      ///< that no carrier moves
  std::vector<RigidBody> parts_;
  std::vector<std::unique_ptr<DynamicRobot>> dynamic_;  ///< by robot; null where the scenario has no dynamics
  std::vector<int> levels_;                             ///< by robot
  std::vector<std::size_t> segment_begin_;              ///< by robot
  struct RobotEnergy {
    double mechanical_J = 0.0;  ///< at the end of the robot's last time at LoD 2
    double electrical_J = 0.0;  ///< at the end of the last accepted step
  };
  std::vector<RobotEnergy> energies_;                               ///< by robot
  std::vector<std::pair<std::size_t, std::size_t>> gripper_place_;  ///< robot, index among its grippers
  std::unique_ptr<OdeSystem> system_;
  std::unique_ptr<Integrator> integrator_;
  std::vector<double> x_, accepted_;
  std::vector<std::size_t> auxiliary_segments_;  ///< by further model: begin of its states
  std::size_t auxiliary_begin_ = 0, parts_begin_ = 0;
  std::vector<ForcedSignal> forced_;
  const MachineSignals* machines_ = nullptr;
  double now_s_ = 0.0;
  double (*clock_)() = nullptr;
  bool motion_allowed_ = true;
  double speed_override_ = 1.0;
};

}  // namespace takt
