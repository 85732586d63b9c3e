#pragma once
// The simulation of one cell: a fixed set of components, robots and grippers, advanced by fixed communication
// steps. It is independent of transport, threads, files and clocks; the same model and the same commands give
// the same bits.
//
// Simulation::step(commands) is the whole algorithm:
//   1 apply commands        set-points (of trajectories too), targets of grippers and devices; no motion
//   2 update connections    poses at t -> AABB broad phase -> MPR -> contact graph -> partner search ->
//                           offsets of changed partners. Every discrete decision is taken here, between
//                           accepted steps. Then collision checking of robot programs, which only watches.
//   3 integrate t -> t+h    a pure right-hand side: motion of all bodies -> wrench of every pair into its
//                           own slot -> wrenches summed per component in pair order -> derivatives
//   4 check and count       every state finite, state hash chained, step counter advanced
// Time is step_index * step size, never a running sum.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/contact/clearance/clearance_model.h"
#include "server/contact/collision/pair_queries.h"
#include "server/contact/surface/contact_interaction.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/signals.h"
#include "server/simulation/model/snapshot.h"
#include "server/simulation/model/solver.h"
#include "server/simulation/step/explanation.h"

namespace takt {

struct CellModel;       // simulation/model/cell_model.h: everything constant after loading
struct PairConnection;  // contact/holding/connections.h

/// Counts since the last reset or restored state, and computing time by stage if a clock was set
/// (set_stage_clock).
struct SimulationStatistics {
  std::uint64_t steps = 0;
  std::uint64_t derivative_evaluations = 0;
  std::uint64_t broad_phase_tests = 0;
  std::uint64_t mpr_calls = 0;    ///< executed calls
  std::uint64_t mpr_skipped = 0;  ///< convex pairs not tested: the boxes are apart, or neither side moved
  std::uint64_t partner_searches = 0;
  std::uint64_t connection_changes = 0;
  std::uint64_t part_steps_skipped = 0;   ///< steps of single Parts left out because they rest
  std::uint64_t clearance_pairs = 0;      ///< collision checking: pairs whose poses were evaluated
  std::uint64_t clearance_distances = 0;  ///< distances of convex shapes computed for them
  double connections_s = 0.0;             ///< all of stage 2
  double broad_phase_s = 0.0, mpr_s = 0.0, partner_search_s = 0.0;  ///< its parts
  double clearance_s = 0.0;                                         ///< collision checking, in stage 2 too
  double integration_s = 0.0;                                       ///< all of stage 3
  double forces_s = 0.0;                                            ///< its wrenches
  SolverStatistics solver;
};

/// Events of the most recent step; valid until the next one.
struct StepEvents {
  std::span<const ConnectionChange> connection_changes;  ///< changes of partner decided in it
  std::span<const MotionNotice> motion_notices;          ///< of trajectories and deadlines
  /// Results of collision checking at the beginning of the step (first step: also of loading or reset). Empty
  /// if the scenario does not check.
  std::span<const CollisionEvent> collision_events;
  std::span<const WeakGrip> weak_grips;  ///< grips that were found too weak at its beginning
  /// Alternating contact forces detected at the beginning of the step; each Part once.
  std::span<const AlternatingForce> alternating_forces;
  std::span<const DeviceNotice> device_notices;
  std::span<const DeviceMessage> device_messages;  ///< at its beginning; first step: also of the start
};

class Simulation {
 public:
  explicit Simulation(std::shared_ptr<const CellModel> model);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const CellDescription& description() const;
  const CellModel& model() const;

  /// Advances by one step. `commands` take effect at the present time, in the order given. Returns false if
  /// the cell cannot be advanced: a state diverged (1e30 and more, or not a number), the solver failed, or a
  /// plant model threw. The last accepted state then stays, fault() has time, component and quantity, and
  /// every later call returns false until reset(). No exception of a plant model leaves any function of the
  /// simulation: it becomes the fault.
  bool step(std::span<const Command> commands);
  const std::string& fault() const;  ///< valid until restore_state()

  /// Whether robots react to missed deadlines of their set-points (RobotDescription::command_deadline). Off
  /// by default: in lockstep the controller's time-out takes this role.
  void watch_deadlines(bool watch);
  StepEvents events() const;
  /// End of the newest trajectory of a robot; negative: without trajectory.
  double trajectory_end_s(std::size_t robot) const;

  /// Back to the initial state, at the present levels of detail; the epoch counts up.
  void reset();

  std::uint64_t step_index() const;
  double time_s() const;
  std::uint32_t epoch() const;
  /// Chained over the states of all steps since the last reset.
  std::uint64_t state_hash() const;

  /// A snapshot of the right size for this cell, to be refilled with read_snapshot(), which does not
  /// allocate. If a plant model throws, the quantities that depend on it keep their values.
  Snapshot make_snapshot() const;
  void read_snapshot(Snapshot& snapshot) const;
  // Parts of read_snapshot(), for a fraction of its cost; the others keep what they have.
  /// Step, epoch, time, hash.
  void read_instant(Snapshot& snapshot) const;
  /// All of one component but its wrench.
  void read_component(int component, ComponentSample& sample) const;
  /// Robots, grippers and devices but for the forces of dynamic robots.
  void read_machines(Snapshot& snapshot) const;
  /// Instant, robots, devices and contacts, and the holder and the wrench of components that are held.
  void read_loads(Snapshot& snapshot) const;
  /// Largest number of contacts in a snapshot of this cell.
  std::size_t contact_capacity() const;

  /// Explains the state of this component: the holder of a Part, the rule, and the time of the decision.
  /// `component` must be an id of this cell. Changes no state and no hash; bounded cost (explanation.h), but
  /// it allocates: not for every step.
  Explanation explain(int component) const;

  /// Sets the level of detail (1 to 3) of a process (index; -1: all) at the present instant. Poses, twists
  /// and joint motion carry over; drives start in equilibrium with them. Empty on success, else the reason
  /// why a robot of the process cannot have that level, without any change; or the fault, if the cell has
  /// one. Allocates.
  std::string set_level_of_detail(int process, int level);
  /// The solver in use; it differs while pairs act by surface contact.
  const SolverParameters& solver() const;
  /// Of a robot, at present.
  int level_of_detail(std::size_t robot) const;
  /// Of a process (index into CellDescription::processes), at present.
  int process_level(std::size_t process) const;

  /// The complete state between two steps, as bytes: all that influences later steps, so that a simulation of
  /// the same model that restores them continues with the same bits, hash included. Not included: counts of
  /// work and stage times (statistics()), and caches (verdicts and hints of collision checks, candidate lists
  /// and results of contacts), which change no bit. `out` is overwritten; it allocates only to grow.
  ///
  /// Exceptions are cvode, esdirk, esdirk4 and ida, whose memory of earlier steps is inside SUNDIALS. Saving
  /// restarts them at this instant, so that the saving and the restored run have the same bits; they differ
  /// from a run without saving within the solver's tolerance. This allocates.
  ///
  /// Empty on success; else the reason why restore_state() would refuse these bytes (a diverged state: an
  /// invalid quaternion or a value out of bounds), and `out` is empty. A trial restoration finds this; it
  /// allocates and takes as long as a restoration, and is made only for suspicious states (1e9, or a
  /// quaternion off its length by 1e-3).
  std::string save_state(std::vector<std::byte>& out);
  /// Returns to a state that save_state() made of the same model. Empty on success; else a sentence with the
  /// reason, without any change: the bytes may be truncated, altered or foreign. The epoch increases beyond
  /// the present and the saved one, so that receivers of earlier instants recognise them as void. Statistics
  /// start at zero. References and spans returned by this simulation become invalid, except those of model()
  /// and description(). Allocates.
  std::string restore_state(std::span<const std::byte> bytes);

  /// Attaches the Part to this component (a Ground, a Part, or a Gripper by its palm) from the next step on,
  /// until detach(): at their relative pose at that time, with or without contact, whatever the interaction
  /// algorithm's rules decide. It is an additional connection of the substitute force, at every level of
  /// detail; surface contact between the two is off meanwhile. With partner search, a Part attached to a held
  /// Part has that Part's holder, as all Parts that ride on it; Parts that ride on the attached Part go with
  /// it. Empty on success, else the reason, without any change. For a Part that is already attached the call
  /// replaces component and pose. May allocate.
  std::string attach(int part, int component);
  /// The rules decide again, from the next step on; the present connection stays where they agree with it.
  std::string detach(int part);
  /// Moves a Part at once: pose of its frame B and twist of B's origin. Its connections are decided in the
  /// next step and take their offsets there. Empty on success, else the reason, without any change.
  std::string set_component_state(int component, const Pose& X_WB, const Twist& V_WB);

  /// Gives the signal this value until it is released, whatever commands, wires and the device say; an input takes it
  /// as it would take a command. `value` must be one of the signal (wrong_value()). reset() releases all. Empty on
  /// success, else the fault, or the other input of a gripper that is forced already. May allocate.
  std::string force_signal(SignalRef ref, double value);
  /// A reported signal has its measured value again, an input that of its newest command or wire. Empty on success, else
  /// the reason: it is not forced.
  std::string release_signal(SignalRef ref);
  std::span<const ForcedSignal> forced_signals() const;
  /// Gives inputs values between two steps, as commands do. Each has no wire, and each value is one of the signal
  /// (wrong_value()). A forced input takes its value at the release. Empty on success, else the reason, without any
  /// change: the fault, or a gripper while a safety device stops the cell. May allocate.
  std::string set_inputs(std::span<const InputValue> values);
  /// Present value, forced ones included.
  double signal(SignalRef ref) const;

  /// All closed connections, by base, then target; valid until the next step or reset.
  std::span<const PairConnection> connections() const;
  /// Present wrench of a connection on its Base, about the Base's centre of mass, with the weight that passes
  /// through it; the Target gets the balanced reaction.
  Wrench pair_wrench(const PairConnection& pair) const;
  /// Pairs with pressure by surface contact at this time (level of detail 3), in the order of the pairs.
  void read_contacts(std::vector<ContactSample>& samples) const;
  /// The largest normal forces of the most recent step, by pair, each with its time: at the ends of the solver's own steps
  /// within it, as an impact is far shorter than a communication step; without watch_contact_peaks() at its end alone.
  void read_contact_peaks(std::vector<ContactPeak>& peaks) const;
  /// Whether steps note them. SUNDIALS evaluates the contacts once more for each of its steps; no bit of a state depends
  /// on it. Not by default.
  void watch_contact_peaks(bool watch);
  ContactCallCounts contact_counts() const;
  /// What surface contact keeps in memory, for tests and measurements.
  ContactInteraction::Size contact_size() const;
  /// Load of the friction at a gripper (index) at the beginning of the most recent step.
  const GripLoad& grip_load(std::size_t gripper) const;
  const SimulationStatistics& statistics() const;

  /// Optional: shares the collision checks of steps with at least `least_calls` calls with this executor,
  /// which must outlive its use. Bits and counts do not depend on it.
  void set_executor(Executor* executor, std::uint64_t least_calls = PairQueries::kLeastCalls);

  /// Optional: a monotonic clock in seconds, used only to fill the stage times of the statistics.
  void set_stage_clock(double (*now_s)());

  struct Impl;  ///< simulation_impl.h

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt
