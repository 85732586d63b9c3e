#pragma once
// Inside of Simulation, shared by its source files.
#include <algorithm>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/contact/clearance/clearance_monitor.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/hashed_state.h"
#include "server/simulation/model/state_hash.h"
#include "server/simulation/step/cell_plant.h"
#include "server/simulation/step/divergence_monitor.h"
#include "server/simulation/step/exact_sleeping.h"
#include "server/simulation/step/force_alternation.h"
#include "server/simulation/step/grasping.h"
#include "server/simulation/step/grip_loads.h"
#include "server/simulation/step/reference_motion.h"
#include "server/simulation/step/signal_image.h"
#include "server/simulation/step/simulation.h"
#include "server/simulation/step/threshold_sleeping.h"

namespace takt {

struct Simulation::Impl {
  struct CommandCounter {
    std::uint64_t count = 0;
    SimTime newest_stamp;
    void note(SimTime stamp) {
      ++count;
      if (stamp.given()) newest_stamp = stamp;
    }
  };

  explicit Impl(std::shared_ptr<const CellModel> cell_model);

  double time() const { return static_cast<double>(step_index) * model->step_s; }
  OdeSystem& system() { return plant.system(); }

  /// Initial state, at the present levels of detail; initially at those of the model.
  void start();
  /// Level of detail of each component: the highest of its processes.
  std::vector<int> component_levels() const;
  /// Selects the pairs with surface contact at the present levels of detail: both sides have level 3, a
  /// Ground having the level of the Parts on it, unless the scenario prescribes the substitute force or one
  /// is attached to the other.
  void choose_forces();
  void choose_grippers();
  /// Passes the compliance of the grippers of dynamic robots to the interaction.
  void note_yielding();
  /// After a change of levels of processes or of attachments: forces, robots' levels, all awake.
  void regroup(const std::vector<int>& robot_levels);
  void refresh_motion();
  /// Finds pairs that may press in the next step, if surface contact acts.
  void find_near();

  void apply(const JointCommand& command);
  /// A safety device stops the cell: a notice, at each command or at the first of a stop.
  bool refuses(std::size_t robot, bool each_time);
  /// The robot has no drives that take torques; a notice, at the first of a row of commands.
  bool refuses_torques(std::size_t robot);
  /// Torque mode, ahead of the commands of a step: the references follow their robots.
  void follow_torques();
  /// After them: the torques of the step. Drives that leave torque mode go on with those they had.
  void set_torques();
  void apply(const GripperCommand& command);
  void apply(const TrajectoryCommand& command);
  void apply(const DeviceCommand& command);
  /// What mechanisms do at the begin of a step: Parts that enter and leave, stop of all motion.
  void begin_mechanisms();
  void note_devices();
  /// For StepControl: see there.
  void park(int part);
  void bring_in(int part, const Pose& X_WB, const Twist& V_WB);
  /// A Part (its place) has another state, given by the user or a device.
  void moved(std::size_t part, const Pose& X_WB, const Twist& V_WB);
  /// Puts the Parts of pools back to where they are parked.
  void park_pools();
  bool is_parked(int component) const {
    const int place = exact_sleeping.place_of(component);
    return place >= 0 && exact_sleeping.is_parked(static_cast<std::size_t>(place));
  }
  /// Discrete decisions of auxiliary plant models between steps.
  void decide();
  void update_connections();
  /// Reads poses and partners; the simulation reads none of its results.
  void check_clearances();
  bool accept();
  void hash_robots();
  /// Signals that are plain numbers between steps, and forced ones.
  void hash_signals();
  /// Each Part has a hash of its own, and the state's hash is chained over their sum: Parts at rest are not
  /// hashed again.
  void hash_parts();
  void rest();
  /// Parts penetrate others in the initial state and no request has moved them: sets the fault.
  bool overlaps_at_start();
  bool step(std::span<const Command> commands);
  bool diverged(std::size_t state);
  bool integrate();
  std::string passing_text(const ContactInteraction::Passing& found) const;
  bool solver_failed();
  bool fall_back();
  void fill(Snapshot& snapshot);
  void fill_instant(Snapshot& snapshot) const;
  void fill_component(int component, ComponentSample& sample);
  /// The whole sample, unless it has these bits already.
  void renew_component(int component, const Wrench& wrench, ComponentSample& sample);
  const Quat& quaternion_of(int component);
  PartState part_state_of(int component, int partner) const;
  /// About the component's origin.
  Wrench wrench_on(int component, std::span<const Wrench> wrenches);
  void fill_robot(std::size_t robot, RobotSample& sample);
  /// Forces of a dynamic robot.
  void fill_robot_loads(std::size_t robot, std::span<const Wrench> wrenches, RobotSample& sample);
  void fill_gripper(std::size_t gripper, GripperSample& sample);
  void fill_devices(Snapshot& snapshot);
  void fill_contacts(ContactsSample& sample);
  /// Where surface contact acts between the two: its depth in place of the overlap of convex shapes.
  void measure_by_contact(std::span<const ContactSample> samples, ExplainedContact& contact) const;

  void save(std::vector<std::byte>& out);
  /// Loads into a new Impl. Throws StateError.
  void load(std::span<const std::byte> bytes);
  /// A new Impl with these bytes; also throws the exceptions of its models during evaluation.
  static std::unique_ptr<Impl> loaded(const std::shared_ptr<const CellModel>& model,
                                      std::span<const std::byte> bytes);
  /// The state has suspicious values, so that load() might refuse it.
  bool in_doubt() const;
  /// Message with the component's name if it does not exist or is not a Part; else empty.
  std::string not_a_part(int component, const char* wanted) const;
  void wake_all();
  void input_changed();
  /// After attach and detach: the fault, if one arose.
  std::string changed_holds();

  /// Keeps exceptions of plant models inside the simulation. The state stays the last accepted one;
  /// exceptions during integration end in advance(), which returns false.
  template <class Work>
  void guard(const Work& work) {
    try {
      work();
    } catch (const std::exception& error) {
      motion_is_current = false;
      if (fault.empty())
        fault = "the cell cannot be advanced from t = " + std::to_string(time()) + " s: " + error.what() +
                "; the last accepted state is kept.";
    }
  }

  std::shared_ptr<const CellModel> model;
  ComponentInteraction interaction;
  ContactInteraction contacts;
  Grasping grasping;
  GripLoads grip_loads;
  ForceAlternation alternation;
  std::vector<std::unique_ptr<PartMechanism>> mechanisms;
  bool mechanism_let_go = false;  ///< attachments changed in the last step
  CellPlant plant;
  std::vector<const HashedState*> hashed_devices;  ///< among those of the plant
  SignalImage signals;
  ExactSleeping exact_sleeping;
  ThresholdSleeping threshold_sleeping;
  /// By component, of the last sample. Most Parts do not turn between two samples.
  struct Orientation {
    Mat3 R_WB = Mat3::Identity();
    Quat q_WB = Quat::Identity();
  };
  std::vector<Orientation> orientations;
  std::vector<std::uint64_t> part_hashes;
  std::uint64_t parts_hash = 0;
  std::vector<CommandCounter> robot_commands, gripper_commands, device_commands;
  std::vector<MotionNotice> motion_notices;        ///< of the most recent step
  std::vector<ReferenceMotion> reference_motions;  ///< by robot
  std::vector<char> refused;                       ///< by robot: a command was refused in this stop
  std::vector<char> torques_refused;               ///< by robot: the last command, which was one of torques
  std::vector<std::optional<JointArray>> torques_before;  ///< by robot in torque mode: in the last step
  bool watch_deadlines = false;
  std::vector<int> process_levels;  ///< at present
  std::vector<ConnectionChange> changes;
  std::vector<DeviceNotice> device_notices;  ///< of the most recent step
  std::vector<DeviceMessage> device_messages;
  DivergenceMonitor watch;
  std::vector<char> start_overlaps;           ///< by the model's entry: still present
  std::unique_ptr<ClearanceMonitor> monitor;  ///< nullptr without checked pairs
  std::vector<CollisionEvent> collisions;
  PartnerHistory history;
  std::uint64_t step_index = 0;
  std::uint32_t epoch = 0;
  StateHash hash;
  std::string fault;
  SimulationStatistics statistics;
  double (*clock)() = nullptr;
  bool motion_is_current = false;
  std::uint64_t identity = 0;  ///< of the model
  Executor* executor = nullptr;
  std::uint64_t least_calls = PairQueries::kLeastCalls;
};

}  // namespace takt
