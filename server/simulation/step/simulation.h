#pragma once
// The simulation of one cell: a fixed set of components, robots and grippers, advanced by fixed communication
// steps. It knows no transport, thread, file or clock; the same model and the same commands give the same
// bits.
//
// Simulation::step(commands) is the whole algorithm:
//   1 apply commands        set-points (of trajectories too), targets of grippers and devices; nothing moves
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
#include "server/simulation/model/snapshot.h"
#include "server/simulation/model/solver.h"
#include "server/simulation/step/explanation.h"

namespace takt {

struct CellModel;       // simulation/cell_model.h: everything constant after loading
struct PairConnection;  // contact/connections.h

/// Counts since the last reset or restored state, and computation time by stage where a clock was supplied
/// (see set_stage_clock).
struct SimulationStatistics {
  std::uint64_t steps = 0;
  std::uint64_t derivative_evaluations = 0;
  std::uint64_t broad_phase_tests = 0;
  std::uint64_t mpr_calls = 0;    ///< calls made
  std::uint64_t mpr_skipped = 0;  ///< convex pairs not tested: the boxes are apart, or neither side moved
  std::uint64_t partner_searches = 0;
  std::uint64_t connection_changes = 0;
  std::uint64_t part_steps_skipped = 0;   ///< steps of single Parts left out because they rest
  std::uint64_t clearance_pairs = 0;      ///< collision checking: pairs whose poses were looked at
  std::uint64_t clearance_distances = 0;  ///< distances of convex shapes computed for them
  double connections_s = 0.0;             ///< all of stage 2
  double broad_phase_s = 0.0, mpr_s = 0.0, partner_search_s = 0.0;  ///< its parts
  double clearance_s = 0.0;                                         ///< collision checking, in stage 2 too
  double integration_s = 0.0;                                       ///< all of stage 3
  double forces_s = 0.0;                                            ///< its wrenches
  SolverStatistics solver;
};

/// What there is to report of the most recent step; valid until the next one.
struct StepEvents {
  std::span<const ConnectionChange> connection_changes;  ///< changes of partner decided in it
  std::span<const MotionNotice> motion_notices;          ///< of trajectories and deadlines
  /// What collision checking found at its beginning (with the first step: and when the cell was loaded or
  /// reset). Empty where the scenario does not check.
  std::span<const CollisionEvent> collision_events;
  std::span<const WeakGrip> weak_grips;  ///< grips that were found too weak at its beginning
  /// Contact forces that were found there to alternate from step to step; each Part once.
  std::span<const AlternatingForce> alternating_forces;
};

class Simulation {
 public:
  explicit Simulation(std::shared_ptr<const CellModel> model);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const CellDescription& description() const;
  const CellModel& model() const;

  /// Advances by one step. `commands` take effect at the present time, in the order given. Returns false when
  /// the cell cannot be advanced: a state diverged (1e30 and more, or not a number), the solver gave up, or a
  /// plant model threw. Then the last accepted state is kept, fault() says time, component and quantity, and
  /// every later call returns false until reset(). No exception of a plant model leaves the simulation, from
  /// the other functions neither: they set the fault too.
  bool step(std::span<const Command> commands);
  const std::string& fault() const;  ///< valid until restore_state()

  /// Whether robots act when their set-points stay away for longer than they allow
  /// (RobotDescription::command_deadline). Off at first: for where somebody else waits for commands.
  void watch_deadlines(bool watch);
  StepEvents events() const;
  /// When the newest trajectory of a robot ends; negative: it follows none.
  double trajectory_end_s(std::size_t robot) const;

  /// Back to the initial state, at the present levels of detail; the epoch counts up.
  void reset();

  std::uint64_t step_index() const;
  double time_s() const;
  std::uint32_t epoch() const;
  /// Chained over the states of all steps since the last reset.
  std::uint64_t state_hash() const;

  /// A snapshot of the right size for this cell; fill it again and again with read_snapshot (which does not
  /// allocate). What cannot be computed because a plant model throws stays as it was in it.
  Snapshot make_snapshot() const;
  void read_snapshot(Snapshot& snapshot) const;
  /// Most contacts that a snapshot of this cell holds.
  std::size_t contact_capacity() const;

  /// Why this component is as it is: who holds a Part, by which rule, since when. `component` must be an id
  /// of this cell. Changes nothing, so that the states that follow and their hash are the same whether asked
  /// or not; bounded cost (explanation.h), but not for every step: it allocates.
  Explanation explain(int component) const;

  /// New level of detail (1 to 3) of a process (index; -1: of all), from the present instant on. Poses,
  /// twists and joint motion carry over; drives start in equilibrium with them. Empty if done, else why a
  /// robot of the process cannot have that level, and nothing changes; or the fault, if the cell has one.
  /// Allocates.
  std::string set_level_of_detail(int process, int level);
  /// What integrates at present; another one while pairs act by surface contact.
  const SolverParameters& solver() const;
  /// Of a robot, at present.
  int level_of_detail(std::size_t robot) const;
  /// Of a process (index into CellDescription::processes), at present.
  int process_level(std::size_t process) const;

  /// The complete state between two steps, as bytes: whatever influences what follows, so that a simulation
  /// of the same model that restores them goes on with the same bits, hash included. Not in it: counts of
  /// work and stage times (statistics()), and what only saves work (verdicts and hints of collision checks,
  /// candidate lists and results of contacts), which changes no bit. `out` is overwritten; nothing is
  /// allocated once it has grown.
  ///
  /// The exception are cvode, esdirk, esdirk4 and ida, whose memory of earlier steps lies inside SUNDIALS.
  /// Saving starts them anew at this instant, here too, so that the run that saved and one that restored have
  /// the same bits; the bits are others than without saving, within the solver's tolerance. This allocates.
  ///
  /// Empty if done; else why restore_state() would refuse these bytes (a state that runs away: an orientation
  /// that is none any more, a number beyond all bounds), and `out` is empty. What could be refused is found
  /// by restoring it aside, which allocates and takes as long as restoring; that is only done where a state
  /// has left what cells do (1e9, or a quaternion off its length by 1e-3).
  std::string save_state(std::vector<std::byte>& out);
  /// Back to a state that save_state() made of the same model. Empty if done; else why not, in a sentence,
  /// and nothing has changed: bytes may be cut off, altered or foreign. The epoch counts up, beyond the saved
  /// one too, so that whoever keeps what was sent earlier knows that it is void. Statistics begin anew.
  /// References and spans that this simulation returned become invalid, but for model() and description().
  /// Allocates.
  std::string restore_state(std::span<const std::byte> bytes);

  /// The user's own hold: from the next step on the Part hangs on this component (a Ground, a Part, or a
  /// Gripper by its palm), at the pose relative to it that it has then, whether they touch or not and
  /// whatever the interaction algorithm's rules say, until detach(). It is one more connection of the
  /// substitute force, at every level of detail; surface contact between the two ceases meanwhile. With
  /// partner search, attached to a Part that is held, it is held by who holds that one, as all that rides on
  /// it; and what rides on the attached Part goes with it. Empty if done, else why not, and nothing changes.
  /// A Part that is attached already changes over, or takes its present pose. May allocate.
  std::string attach(int part, int component);
  /// The rules decide again, from the next step on; the present connection stays where they agree with it.
  std::string detach(int part);
  /// Puts a Part elsewhere, at once: pose of its frame B and twist of B's origin. Its connections are decided
  /// anew in the next step and take their offsets there. Empty if done, else why not, and nothing changes.
  std::string set_component_state(int component, const Pose& X_WB, const Twist& V_WB);

  /// All closed connections, by base, then target; valid until the next step or reset.
  std::span<const PairConnection> connections() const;
  /// What one of them exerts on its Base now, about the Base's centre of mass, with the weight that passes
  /// through it; the Target gets the balanced reaction.
  Wrench pair_wrench(const PairConnection& pair) const;
  /// Pairs that press upon each other by surface contact now (level of detail 3), in the order of the pairs.
  void read_contacts(std::vector<ContactSample>& samples) const;
  ContactCallCounts contact_counts() const;
  /// What friction had to carry at a gripper (index) at the beginning of the most recent step.
  const GripLoad& grip_load(std::size_t gripper) const;
  const SimulationStatistics& statistics() const;

  /// Optional: somebody who helps with the collision checks of steps that take at least so many calls, for as
  /// long as it is set. Bits and counts do not depend on it.
  void set_executor(Executor* executor, std::uint64_t least_calls = PairQueries::kLeastCalls);

  /// Optional: a monotonic clock in seconds, used only to fill the stage times of the statistics.
  void set_stage_clock(double (*now_s)());

  struct Impl;  ///< simulation_impl.h

 private:
  std::unique_ptr<Impl> impl_;
};

/// The step at which period number `k` of a sender with the given period begins: the first step not before k
/// * period.
std::uint64_t period_boundary_step(std::uint64_t k, double period_s, double step_s);

}  // namespace takt
