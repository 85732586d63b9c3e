#include "server/simulation/simulation.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <type_traits>
#include <variant>
#include <vector>

#include "server/contact/clearance_monitor.h"
#include "server/simulation/calm_parts.h"
#include "server/simulation/cell_model.h"
#include "server/simulation/cell_plant.h"
#include "server/simulation/grasping.h"
#include "server/simulation/resting_parts.h"
#include "server/simulation/state_hash.h"

namespace takt {

namespace {
// Nothing in a cell comes near, and what follows from a state (powers, energies, loads) is finite below it.
constexpr double kLargestState = 1e30;
// Surface contact looks, within a step, at pairs that are as close as this speed lets them come.
constexpr double kFastest_m_per_s = 10.0;

struct CommandCounter {
  std::uint64_t count = 0;
  double newest_stamp_s = -1.0;
  void note(double stamp_s) {
    ++count;
    if (stamp_s >= 0.0) newest_stamp_s = stamp_s;
  }
};
}  // namespace

struct Simulation::Impl {
  explicit Impl(std::shared_ptr<const CellModel> cell_model)
      : model(std::move(cell_model)),
        interaction(model->components, model->pairs, model->interaction),
        contacts(model->components, model->contact),
        grasping(*model),
        plant(*model, interaction, &contacts),
        resting(model->components, part_bodies(*model)),
        calm(model->components, model->contact.sleeping, model->step_s, contacts, resting),
        part_hashes(model->parts.size(), 0),
        robot_commands(model->robots.size()),
        gripper_commands(model->grippers.size()),
        history(model->components.size()) {
    changes.reserve(2 * model->parts.size());
    if (model->clearance.enabled) {
      monitor =
          std::make_unique<ClearanceMonitor>(model->clearance, base_poses(*model), model->components.size());
      collisions.reserve(4 * model->clearance.pairs.size());
    }
    start();
  }

  static std::vector<int> part_bodies(const CellModel& cell) {
    std::vector<int> result;
    for (const RigidBodyParameters& part : cell.parts) result.push_back(part.body);
    return result;
  }

  double time() const { return static_cast<double>(step_index) * model->step_s; }

  void start() {
    step_index = 0;
    interaction.reset();
    contacts.reset();
    process_levels.clear();
    for (const ProcessDescription& process : model->description.processes)
      process_levels.push_back(process.level_of_detail);
    choose_forces();
    plant.reset();
    resting.wake_all();
    calm.wake_all();
    std::fill(part_hashes.begin(), part_hashes.end(), 0);
    parts_hash = 0;
    grasping.reset();
    hash.reset();
    fault.clear();
    changes.clear();
    collisions.clear();
    if (monitor) monitor->reset();
    history.reset();
    statistics = {};
    for (auto& counter : robot_commands) counter = {};
    for (auto& counter : gripper_commands) counter = {};
    motion_is_current = false;
    choose_grippers();
    update_connections();  // a cell that stands still already knows who holds whom
  }

  /// Level of detail of a component: the highest of its processes.
  int component_level(int component) const {
    int level = 1;
    for (std::size_t p = 0; p < process_levels.size(); ++p) {
      const std::vector<int>& members = model->description.processes[p].components;
      if (std::find(members.begin(), members.end(), component) != members.end())
        level = std::max(level, process_levels[p]);
    }
    return level;
  }

  /// Which pairs act by surface contact at the present levels of detail: those whose sides both have level 3,
  /// Grounds taking the level of what lies on them, unless the scenario wants the substitute force there.
  void choose_forces() {
    if (!model->contact.enabled) return;
    std::vector<int> levels;
    for (std::size_t c = 0; c < model->components.size(); ++c)
      levels.push_back(
          model->components[c].type == ComponentType::ground ? 3 : component_level(static_cast<int>(c)));
    std::vector<char> acting;
    std::vector<std::pair<int, int>> by_contact;
    for (const ContactPairModel& pair : model->contact.pairs) {
      const bool acts = pair.force != PairForce::substitute &&
                        levels[static_cast<std::size_t>(pair.base)] == 3 &&
                        levels[static_cast<std::size_t>(pair.target)] == 3;
      acting.push_back(acts ? 1 : 0);
      if (acts) by_contact.emplace_back(pair.base, pair.target);
    }
    contacts.set_acting(acting);
    interaction.set_by_contact(by_contact);
    if (monitor) monitor->set_by_contact(by_contact);
  }

  void choose_grippers() {
    if (!model->contact.enabled) return;
    for (std::size_t g = 0; g < model->grippers.size(); ++g)
      grasping.set_by_contact(g, component_level(model->grippers[g].parameters.palm) == 3, time(), plant);
  }

  void refresh_motion() {
    if (motion_is_current) return;
    system().update_motion(time(), plant.state());
    motion_is_current = true;
  }

  void apply(const JointCommand& command) {
    KinematicRobot& robot = plant.robots()[static_cast<std::size_t>(command.robot)];
    // Commands are validated at the boundary; this is the second line of defence, for callers that make their
    // own.
    for (std::size_t j = 0; j < robot.parameters().arm.joints.size(); ++j) {
      if (std::isfinite(command.position[j]) && std::isfinite(command.velocity[j])) continue;
      fault = "the set-point of joint '" + robot.parameters().arm.joints[j].name + "' of " +
              model->description.robots[static_cast<std::size_t>(command.robot)].name +
              " at t = " + std::to_string(time()) +
              " s is not a finite number; the last accepted state is kept.";
      return;
    }
    const double period =
        command.period_s > 0.0
            ? command.period_s
            : model->description.robots[static_cast<std::size_t>(command.robot)].command_period_s;
    robot.set_point(time(), period, command.position.data(),
                    command.has_velocity ? command.velocity.data() : nullptr);
    robot_commands[static_cast<std::size_t>(command.robot)].note(command.stamp_s);
  }

  void apply(const GripperCommand& command) {
    grasping.apply(command, time(), plant);
    gripper_commands[static_cast<std::size_t>(command.gripper)].note(command.stamp_s);
  }

  void update_connections() {
    refresh_motion();
    interaction.update_poses(system().motion(), system().active_bodies(), clock);
    if (interaction.refused_pose() >= 0) {
      // States are finite (accept()), but what follows from them may overflow.
      fault = "the pose of " + model->components[static_cast<std::size_t>(interaction.refused_pose())].name +
              " became non-finite at t = " + std::to_string(time()) +
              " s; the last accepted state is kept. A smaller step may help.";
      return;
    }
    if (contacts.any_acting()) {
      contacts.accept(system().motion());
      contacts.update(system().motion(), kFastest_m_per_s * model->step_s);
    }
    grasping.update(time(), model->step_s, system().motion(), plant, interaction, contacts);
    interaction.update_connections(system().motion(), grasping.states(), clock);
    history.note(time(), step_index, interaction.changes());
    const bool changed = resting.wake_changed(interaction);
    const bool reached = contacts.any_acting() && calm.wake_reached(system().motion());
    if (changed || reached) system().set_awake(resting.awake());
    if (reached || !interaction.disturbed().empty()) plant.integrator().restart();
    // What the initial state decided belongs to the first step.
    if (step_index > 0) changes.clear();
    for (const PartnerChange& change : interaction.changes())
      changes.push_back({time(), step_index, change.part, change.from, change.to});
    if (monitor) check_clearances();
  }

  /// Reads poses and partners, writes nothing that the simulation reads.
  void check_clearances() {
    const double begin = clock != nullptr ? clock() : 0.0;
    monitor->update(time(), step_index, system().motion(), system().active_bodies(), interaction.changes());
    if (step_index > 0) collisions.clear();
    collisions.insert(collisions.end(), monitor->events().begin(), monitor->events().end());
    if (clock != nullptr) statistics.clearance_s += clock() - begin;
  }

  bool accept() {
    const std::vector<double>& x = plant.state();
    for (const OdeSystem::Range& range : system().active_states()) {
      for (std::size_t i = range.begin; i < range.end; ++i)
        if (!(std::abs(x[i]) < kLargestState)) return diverged(i);
    }
    ++step_index;
    statistics.part_steps_skipped += model->parts.size() - resting.awake().size();
    hash_parts();
    if (model->interaction.skip_resting && plant.integrator().fixed_step() && !contacts.any_acting()) rest();
    if (model->contact.sleeping.enabled && plant.integrator().one_step() && contacts.any_acting()) {
      refresh_motion();
      if (calm.fall_asleep(interaction, system().motion())) system().set_awake(resting.awake());
    }
    hash_robots();
    return true;
  }

  void hash_robots() {
    for (std::size_t r = 0; r < plant.robots().size(); ++r) {
      if (plant.dynamic(r) != nullptr) {
        hash.add(plant.segment(r));
        continue;
      }
      const KinematicRobot& robot = plant.robots()[r];
      JointArray q{}, qd{};
      robot.joint_state(time(), q.data(), qd.data());
      const auto n = static_cast<std::size_t>(robot.parameters().arm.joint_count());
      hash.add(std::span<const double>(q.data(), n));
      hash.add(std::span<const double>(qd.data(), n));
    }
    if (!model->further_models.empty()) hash.add(plant.further_states());
    for (const ParallelGripper& gripper : plant.grippers()) {
      hash.add(gripper.coordinate(time(), ParallelGripper::left));
      hash.add(gripper.coordinate(time(), ParallelGripper::right));
    }
  }

  /// Each Part has a hash of its own, the state's is chained over their sum: what rests is not hashed again.
  void hash_parts() {
    for (const int i : resting.awake_indices()) {
      const auto part = static_cast<std::size_t>(i);
      StateHash own;
      own.add(static_cast<std::uint64_t>(part));
      own.add(std::span<const double>(plant.state()).subspan(plant.part_begin(part), RigidBody::kStates));
      const int body = model->parts[part].body;
      const int partner = interaction.partner(body);
      own.add(static_cast<std::uint64_t>(partner + 1));
      for (const PairConnection& pair : interaction.connections_of(body))
        if (pair.connection.partner != partner)
          own.add(static_cast<std::uint64_t>(pair.connection.partner + 1));
      parts_hash += own.value() - part_hashes[part];
      part_hashes[part] = own.value();
    }
    hash.add(parts_hash);
  }

  void rest() {
    const auto parts_of = [this](const std::vector<double>& x) {
      return std::span<const double>(x).subspan(plant.parts_begin());
    };
    if (!resting.rest_unchanged(interaction, parts_of(plant.accepted()), parts_of(plant.state()))) return;
    // The motion still is that of the solver's last trial; what rests is left with its own.
    system().update_motion(time(), plant.state());
    system().set_awake(resting.awake());
  }

  bool step(std::span<const Command> commands) {
    // 1 apply commands
    for (const Command& command : commands) std::visit([this](const auto& c) { apply(c); }, command);
    if (!fault.empty()) return false;
    // 2 update connections
    const auto now = [this] { return clock != nullptr ? clock() : 0.0; };
    const double t0 = now();
    update_connections();
    if (!fault.empty()) return false;
    const double t1 = now();
    // 3 integrate t -> t + h
    plant.keep_accepted();
    const bool arrived = plant.integrator().advance(system(), time(), model->step_s, plant.state());
    motion_is_current = false;
    // 4 check and count
    const double t2 = now();
    statistics.connections_s += t1 - t0;
    statistics.integration_s += t2 - t1;
    return arrived ? accept() : solver_failed();
  }

  bool diverged(std::size_t state) {
    fault = "the state diverged in the step from t = " + std::to_string(time()) +
            " s: " + plant.describe_state(state) + " (state " + std::to_string(state) +
            "); the last accepted state is kept. A smaller step may help.";
    return fall_back();
  }

  bool solver_failed() {
    if (plant.integrator().fixed_step()) {
      // Which state it was says more than that there was one.
      for (const OdeSystem::Range& range : system().active_states())
        for (std::size_t i = range.begin; i < range.end; ++i)
          if (!std::isfinite(plant.state()[i])) return diverged(i);
    }
    fault = "the solver " + plant.solver().name + " failed in the step from t = " + std::to_string(time()) +
            " s: " + plant.integrator().failure() + "; the last accepted state is kept.";
    return fall_back();
  }

  /// Nothing that a plant model throws goes beyond the simulation. The state stays the one last accepted:
  /// what solvers meet ends in advance(), which returns false.
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

  bool fall_back() {
    plant.state() = plant.accepted();
    motion_is_current = false;
    return false;
  }

  void fill(Snapshot& snapshot);

  OdeSystem& system() { return plant.system(); }

  std::shared_ptr<const CellModel> model;
  ComponentInteraction interaction;
  ContactInteraction contacts;
  Grasping grasping;
  CellPlant plant;
  RestingParts resting;
  CalmParts calm;
  std::vector<std::uint64_t> part_hashes;
  std::uint64_t parts_hash = 0;
  std::vector<CommandCounter> robot_commands, gripper_commands;
  std::vector<int> process_levels;  ///< at present
  std::vector<ConnectionChange> changes;
  std::unique_ptr<ClearanceMonitor> monitor;  ///< none where nothing is checked
  std::vector<CollisionEvent> collisions;
  PartnerHistory history;
  std::uint64_t step_index = 0;
  std::uint32_t epoch = 0;
  StateHash hash;
  std::string fault;
  SimulationStatistics statistics;
  double (*clock)() = nullptr;
  bool motion_is_current = false;
};

Simulation::Simulation(std::shared_ptr<const CellModel> model)
    : impl_(std::make_unique<Impl>(std::move(model))) {}
Simulation::~Simulation() = default;

bool Simulation::step(std::span<const Command> commands) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return false;
  bool advanced = false;
  s.guard([&] { advanced = s.step(commands); });
  return advanced && s.fault.empty();
}

const std::string& Simulation::fault() const {
  return impl_->fault;
}

void Simulation::reset() {
  ++impl_->epoch;
  impl_->guard([this] { impl_->start(); });
}

const CellDescription& Simulation::description() const {
  return impl_->model->description;
}
const CellModel& Simulation::model() const {
  return *impl_->model;
}
std::uint64_t Simulation::step_index() const {
  return impl_->step_index;
}
double Simulation::time_s() const {
  return impl_->time();
}
std::uint32_t Simulation::epoch() const {
  return impl_->epoch;
}
std::uint64_t Simulation::state_hash() const {
  return impl_->hash.value();
}
std::span<const ConnectionChange> Simulation::connection_changes() const {
  return impl_->changes;
}
std::span<const PairConnection> Simulation::connections() const {
  return impl_->interaction.connections();
}
Wrench Simulation::pair_wrench(const PairConnection& pair) const {
  impl_->refresh_motion();
  return impl_->interaction.pair_wrench(pair, impl_->system().motion());
}

std::span<const CollisionEvent> Simulation::collision_events() const {
  return impl_->collisions;
}

void Simulation::read_contacts(std::vector<ContactSample>& samples) const {
  impl_->refresh_motion();
  impl_->contacts.read(impl_->system().motion(), samples);
}

ContactCallCounts Simulation::contact_counts() const {
  return impl_->contacts.counts();
}

void Simulation::set_executor(Executor* executor, std::uint64_t least_calls) {
  impl_->contacts.set_executor(executor);
  impl_->interaction.set_executor(executor, least_calls);
}

void Simulation::set_stage_clock(double (*now_s)()) {
  impl_->clock = now_s;
  impl_->plant.set_clock(now_s);
}

const SimulationStatistics& Simulation::statistics() const {
  SimulationStatistics& s = impl_->statistics;
  s.steps = impl_->step_index;
  s.derivative_evaluations = impl_->system().evaluations();
  s.broad_phase_tests = impl_->interaction.counts().broad_phase_tests;
  s.mpr_calls = impl_->interaction.counts().mpr_calls;
  s.mpr_skipped = impl_->interaction.counts().mpr_skipped;
  s.partner_searches = impl_->interaction.partner_searches();
  const ComponentInteraction::StageTimes& times = impl_->interaction.stage_times();
  s.broad_phase_s = times.broad_phase_s;
  s.mpr_s = times.mpr_s;
  s.partner_search_s = times.partner_search_s;
  s.forces_s = impl_->system().forces_s();
  if (impl_->monitor) {
    s.clearance_pairs = impl_->monitor->counts().pairs_asked;
    s.clearance_distances = impl_->monitor->counts().distances;
  }
  s.solver = impl_->plant.integrator().statistics();
  return s;
}

namespace {
void read_dynamics(const DynamicRobot::Output& output, RobotSample& sample) {
  sample.effort = output.torque;
  sample.flange_load_W = output.flange_load_W;
  sample.base_reaction_W = output.base_reaction_W;
  sample.power = output.power;
  sample.drives = output.drives;
}
}  // namespace

std::size_t Simulation::contact_room() const {
  return impl_->model->contact.enabled ? std::min(impl_->contacts.pair_count(), kMostContactSamples) : 0;
}

Snapshot Simulation::make_snapshot() const {
  Snapshot snapshot;
  snapshot.components.resize(impl_->model->components.size());
  snapshot.robots.resize(impl_->model->robots.size());
  snapshot.grippers.resize(impl_->model->grippers.size());
  snapshot.contacts.room.resize(contact_room());
  read_snapshot(snapshot);
  return snapshot;
}

void Simulation::read_snapshot(Snapshot& snapshot) const {
  impl_->guard([&] { impl_->fill(snapshot); });
}

void Simulation::Impl::fill(Snapshot& snapshot) {
  Impl& s = *this;
  const double t = s.time();
  s.refresh_motion();
  const std::span<const Wrench> wrenches = s.system().update_wrenches();
  const CellMotion& motion = s.system().motion();
  snapshot.step = s.step_index;
  snapshot.epoch = s.epoch;
  snapshot.time_s = t;
  snapshot.state_hash = s.hash.value();
  for (std::size_t i = 0; i < snapshot.components.size(); ++i) {
    ComponentSample& sample = snapshot.components[i];
    const BodyMotion& body = motion.bodies[i];
    sample.p_WB = body.X_WB.p;
    sample.q_WB = body.X_WB.quaternion();
    sample.V_WB = body.V_WB;
    sample.F_Bo_W = {wrenches[i].f, wrenches[i].t + (body.p_WBcm - body.X_WB.p).cross(wrenches[i].f)};
    sample.partner = s.interaction.partner(static_cast<int>(i));
    sample.state =
        part_state(s.model->components, s.interaction.graph(), static_cast<int>(i), sample.partner);
  }
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    RobotSample& sample = snapshot.robots[i];
    sample.position = motion.arms[i].q;
    sample.velocity = motion.arms[i].qd;
    sample.commands_applied = s.robot_commands[i].count;
    sample.newest_stamp_s = s.robot_commands[i].newest_stamp_s;
    sample.level_of_detail = s.plant.level(i);
    // A snapshot is filled again and again: at LoD 1 nothing of an earlier LoD 2 may stay.
    const DynamicRobot* robot = s.plant.dynamic(i);
    read_dynamics(robot != nullptr ? robot->output(t, s.plant.segment(i).data(), motion, wrenches)
                                   : DynamicRobot::Output{},
                  sample);
  }
  for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) {
    GripperSample& sample = snapshot.grippers[i];
    sample.width_m = s.plant.width(i, t);
    sample.force_N = 0.0;
    const auto robot = static_cast<std::size_t>(s.model->description.grippers[i].robot);
    if (s.plant.dynamic(robot) != nullptr) {
      for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
        sample.force_N += 0.5 * std::abs(snapshot.robots[robot].effort[s.plant.jaw_joint(i, side)]);
    }
    sample.closed = s.grasping.closed(i);
    sample.commands_applied = s.gripper_commands[i].count;
    sample.newest_stamp_s = s.gripper_commands[i].newest_stamp_s;
  }
  ContactsSample& sample = snapshot.contacts;
  sample.acting = std::find(s.process_levels.begin(), s.process_levels.end(), 3) != s.process_levels.end();
  const std::size_t pressing = s.contacts.read(motion, std::span<ContactSample>(sample.room));
  sample.count = std::min(pressing, sample.room.size());
  sample.omitted = pressing - sample.count;
}

std::string Simulation::set_level_of_detail(int process, int level) {
  Impl& s = *impl_;
  std::vector<int> levels;
  for (std::size_t r = 0; r < s.model->robots.size(); ++r) levels.push_back(s.plant.level(r));
  for (std::size_t p = 0; p < s.model->description.processes.size(); ++p) {
    if (process >= 0 && static_cast<std::size_t>(process) != p) continue;
    for (const int robot : s.model->description.processes[p].robots)
      levels[static_cast<std::size_t>(robot)] = level;
  }
  if (level == 3 && !s.model->contact.enabled)
    return "surface contact was not prepared: the scenario has no section 'contact' and no process that "
           "begins at level 3";
  for (std::size_t r = 0; r < levels.size(); ++r) {
    if (levels[r] > 1 && !s.plant.can_be_dynamic(r))
      return s.model->description.robots[r].name + " can only be kinematic: " + s.model->no_dynamics[r];
  }
  for (std::size_t p = 0; p < s.process_levels.size(); ++p)
    if (process < 0 || static_cast<std::size_t>(process) == p) s.process_levels[p] = level;
  const bool was_good = s.fault.empty();
  s.guard([&] {
    s.refresh_motion();
    s.choose_forces();
    s.plant.change_levels(levels, s.time());
    s.resting.wake_all();
    s.calm.wake_all();
    s.motion_is_current = false;
    s.choose_grippers();
    if (s.contacts.any_acting()) {  // whoever looks before the next step finds who presses
      s.refresh_motion();
      s.contacts.update(s.system().motion(), kFastest_m_per_s * s.model->step_s);
    }
  });
  s.motion_is_current = false;
  return was_good ? s.fault : std::string();
}

const SolverParameters& Simulation::solver() const {
  return impl_->plant.solver();
}

int Simulation::level_of_detail(std::size_t robot) const {
  return impl_->plant.level(robot);
}

int Simulation::process_level(std::size_t process) const {
  return impl_->process_levels[process];
}

Explanation Simulation::explain(int component) const {
  Impl& s = *impl_;
  s.guard([&s] { s.refresh_motion(); });
  Explanation e =
      explain_component(s.model->components, s.interaction, s.system().motion(), s.history, component);
  e.time_s = s.time();
  e.step = s.step_index;
  e.epoch = s.epoch;
  const auto of_component = [component](const auto& pair) {
    return pair.base == component || pair.target == component;
  };
  for (std::size_t i = 0; i < s.contacts.pair_count() && !e.surface_contact; ++i)
    e.surface_contact = s.contacts.acting(i) && of_component(s.contacts.pair(i));
  std::vector<ContactSample> samples;
  s.contacts.read(s.system().motion(), samples);
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(e.pressing), of_component);
  return e;
}

}  // namespace takt
