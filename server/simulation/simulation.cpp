#include "server/simulation/simulation.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>
#include <vector>

#include "plant_models/mechanics/fixed_body.h"
#include "server/contact/clearance_monitor.h"
#include "server/simulation/cell_model.h"
#include "server/simulation/grasping.h"
#include "server/simulation/integrator.h"
#include "server/simulation/resting_parts.h"
#include "server/simulation/state_hash.h"

namespace takt {

namespace {
template <typename T>
std::vector<const PlantModel*> pointers_in_order(const T& robots, const auto& grippers, const auto& grounds,
                                                 const auto& parts) {
  std::vector<const PlantModel*> models;
  for (const auto& m : robots) models.push_back(&m);
  for (const auto& m : grippers) models.push_back(&m);
  for (const auto& m : grounds) models.push_back(&m);
  for (const auto& m : parts) models.push_back(&m);
  return models;
}

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
        robots(model->robots.begin(), model->robots.end()),
        grippers(make_grippers(*model)),
        grounds(make_grounds(*model)),
        parts(model->parts.begin(), model->parts.end()),
        interaction(model->components, model->pairs, model->interaction),
        grasping(*model),
        system(pointers_in_order(robots, grippers, grounds, parts), interaction, model->components.size(),
               robots.size()),
        resting(model->components, part_bodies(*model)),
        integrator(make_integrator(model->solver, system.state_count())),
        x(static_cast<std::size_t>(system.state_count())),
        accepted(x.size()),
        part_hashes(parts.size(), 0),
        robot_commands(robots.size()),
        gripper_commands(grippers.size()),
        history(model->components.size()) {
    changes.reserve(2 * parts.size());
    if (model->clearance.enabled) {
      monitor =
          std::make_unique<ClearanceMonitor>(model->clearance, base_poses(*model), model->components.size());
      collisions.reserve(4 * model->clearance.pairs.size());
    }
    start();
  }

  static std::vector<ParallelGripper> make_grippers(const CellModel& cell) {
    std::vector<ParallelGripper> result;
    for (const GripperModel& gripper : cell.grippers) result.emplace_back(gripper.parameters);
    return result;
  }
  static std::vector<FixedBody> make_grounds(const CellModel& cell) {
    std::vector<FixedBody> result;
    for (const GroundModel& ground : cell.grounds) result.emplace_back(ground.component, ground.X_WB);
    return result;
  }

  static std::vector<int> part_bodies(const CellModel& cell) {
    std::vector<int> result;
    for (const RigidBodyParameters& part : cell.parts) result.push_back(part.body);
    return result;
  }

  double time() const { return static_cast<double>(step_index) * model->step_s; }

  void start() {
    step_index = 0;
    system.initial_state(x);
    accepted = x;
    resting.wake_all();
    system.wake_all();
    std::fill(part_hashes.begin(), part_hashes.end(), 0);
    parts_hash = 0;
    system.reset_counts();
    interaction.reset();
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
    update_connections();  // a cell that stands still already knows who holds whom
  }

  void refresh_motion() {
    if (motion_is_current) return;
    system.update_motion(time(), x);
    motion_is_current = true;
  }

  void apply(const JointCommand& command) {
    KinematicRobot& robot = robots[static_cast<std::size_t>(command.robot)];
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
    grasping.apply(command, time(), grippers[static_cast<std::size_t>(command.gripper)]);
    gripper_commands[static_cast<std::size_t>(command.gripper)].note(command.stamp_s);
  }

  void update_connections() {
    refresh_motion();
    interaction.update_poses(system.motion(), system.active_bodies(), clock);
    if (interaction.refused_pose() >= 0) {
      // States are finite (accept()), but what follows from them may overflow.
      fault = "the pose of " + model->components[static_cast<std::size_t>(interaction.refused_pose())].name +
              " became non-finite at t = " + std::to_string(time()) +
              " s; the last accepted state is kept. A smaller step may help.";
      return;
    }
    grasping.update(time(), model->step_s, system.motion(), grippers, interaction);
    interaction.update_connections(system.motion(), grasping.states(), clock);
    history.note(time(), step_index, interaction.changes());
    if (resting.wake_changed(interaction)) system.set_awake(resting.awake());
    // What the initial state decided belongs to the first step.
    if (step_index > 0) changes.clear();
    for (const PartnerChange& change : interaction.changes()) {
      changes.push_back({time(), step_index, change.part, change.from, change.to});
    }
    if (monitor) check_clearances();
  }

  /// Reads poses and partners, writes nothing that the simulation reads.
  void check_clearances() {
    const double begin = clock != nullptr ? clock() : 0.0;
    monitor->update(time(), step_index, system.motion(), system.active_bodies(), interaction.changes());
    if (step_index > 0) collisions.clear();
    collisions.insert(collisions.end(), monitor->events().begin(), monitor->events().end());
    if (clock != nullptr) statistics.clearance_s += clock() - begin;
  }

  bool accept() {
    for (const OdeSystem::Range& range : system.active_states()) {
      for (std::size_t i = range.begin; i < range.end; ++i)
        if (!std::isfinite(x[i])) return diverged(i);
    }
    ++step_index;
    statistics.part_steps_skipped += parts.size() - resting.awake().size();
    hash_parts();
    if (model->interaction.skip_resting) rest();
    for (const KinematicRobot& robot : robots) {
      JointArray q{}, qd{};
      robot.joint_state(time(), q.data(), qd.data());
      const auto n = static_cast<std::size_t>(robot.parameters().arm.joint_count());
      hash.add(std::span<const double>(q.data(), n));
      hash.add(std::span<const double>(qd.data(), n));
    }
    for (const ParallelGripper& gripper : grippers) {
      hash.add(gripper.coordinate(time(), ParallelGripper::left));
      hash.add(gripper.coordinate(time(), ParallelGripper::right));
    }
    return true;
  }

  /// Each Part has a hash of its own, the state's is chained over their sum: what rests is not hashed again.
  void hash_parts() {
    for (const int i : resting.awake_indices()) {
      const auto part = static_cast<std::size_t>(i);
      StateHash own;
      own.add(static_cast<std::uint64_t>(part));
      own.add(std::span<const double>(x).subspan(part * RigidBody::kStates, RigidBody::kStates));
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
    if (!resting.rest_unchanged(interaction, accepted, x)) return;
    // The motion still is that of the solver's last trial; what rests is left with its own.
    system.update_motion(time(), x);
    system.set_awake(resting.awake());
  }

  bool diverged(std::size_t state) {
    static constexpr const char* kQuantity[RigidBody::kStates] = {
        "position x",         "position y",         "position z",        "orientation w", "orientation x",
        "orientation y",      "orientation z",      "velocity x",        "velocity y",    "velocity z",
        "angular velocity x", "angular velocity y", "angular velocity z"};
    const std::size_t part = state / RigidBody::kStates;
    const int body = model->parts[part].body;
    fault = "the state became non-finite in the step from t = " + std::to_string(time()) +
            " s: " + kQuantity[state % RigidBody::kStates] + " of " +
            model->components[static_cast<std::size_t>(body)].name + " (state " + std::to_string(state) +
            "); the last accepted state is kept. A smaller step may help.";
    x = accepted;
    motion_is_current = false;
    return false;
  }

  std::shared_ptr<const CellModel> model;
  std::vector<KinematicRobot> robots;
  std::vector<ParallelGripper> grippers;
  std::vector<FixedBody> grounds;
  std::vector<RigidBody> parts;
  ComponentInteraction interaction;
  Grasping grasping;
  OdeSystem system;
  RestingParts resting;
  std::unique_ptr<Integrator> integrator;
  std::vector<double> x, accepted;
  std::vector<std::uint64_t> part_hashes;
  std::uint64_t parts_hash = 0;
  std::vector<CommandCounter> robot_commands, gripper_commands;
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

  // 1 apply commands
  for (const Command& command : commands) {
    std::visit([&s](const auto& c) { s.apply(c); }, command);
  }
  if (!s.fault.empty()) return false;
  // 2 update connections
  const auto now = [&s] { return s.clock != nullptr ? s.clock() : 0.0; };
  const double t0 = now();
  s.update_connections();
  if (!s.fault.empty()) return false;
  const double t1 = now();
  // 3 integrate t -> t + h
  for (const OdeSystem::Range& range : s.system.active_states())
    std::copy(s.x.begin() + static_cast<std::ptrdiff_t>(range.begin),
              s.x.begin() + static_cast<std::ptrdiff_t>(range.end),
              s.accepted.begin() + static_cast<std::ptrdiff_t>(range.begin));
  s.integrator->advance(s.system, s.time(), s.model->step_s, s.x);
  s.motion_is_current = false;
  // 4 check and count
  const double t2 = now();
  s.statistics.connections_s += t1 - t0;
  s.statistics.integration_s += t2 - t1;
  return s.accept();
}

const std::string& Simulation::fault() const {
  return impl_->fault;
}

void Simulation::reset() {
  for (KinematicRobot& robot : impl_->robots) robot.reset();
  for (ParallelGripper& gripper : impl_->grippers) gripper.reset();
  ++impl_->epoch;
  impl_->start();
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
  return impl_->interaction.pair_wrench(pair, impl_->system.motion());
}

std::span<const CollisionEvent> Simulation::collision_events() const {
  return impl_->collisions;
}

void Simulation::set_executor(Executor* executor, std::uint64_t least_calls) {
  impl_->interaction.set_executor(executor, least_calls);
}

void Simulation::set_stage_clock(double (*now_s)()) {
  impl_->clock = now_s;
  impl_->system.set_clock(now_s);
}

const SimulationStatistics& Simulation::statistics() const {
  SimulationStatistics& s = impl_->statistics;
  s.steps = impl_->step_index;
  s.derivative_evaluations = impl_->system.evaluations();
  s.broad_phase_tests = impl_->interaction.counts().broad_phase_tests;
  s.mpr_calls = impl_->interaction.counts().mpr_calls;
  s.mpr_skipped = impl_->interaction.counts().mpr_skipped;
  s.partner_searches = impl_->interaction.partner_searches();
  const ComponentInteraction::StageTimes& times = impl_->interaction.stage_times();
  s.broad_phase_s = times.broad_phase_s;
  s.mpr_s = times.mpr_s;
  s.partner_search_s = times.partner_search_s;
  s.forces_s = impl_->system.forces_s();
  if (impl_->monitor) {
    s.clearance_pairs = impl_->monitor->counts().pairs_asked;
    s.clearance_distances = impl_->monitor->counts().distances;
  }
  return s;
}

Snapshot Simulation::make_snapshot() const {
  Snapshot snapshot;
  snapshot.components.resize(impl_->model->components.size());
  snapshot.robots.resize(impl_->robots.size());
  snapshot.grippers.resize(impl_->grippers.size());
  read_snapshot(snapshot);
  return snapshot;
}

void Simulation::read_snapshot(Snapshot& snapshot) const {
  Impl& s = *impl_;
  const double t = s.time();
  s.refresh_motion();
  const std::span<const Wrench> wrenches = s.system.update_wrenches();
  const CellMotion& motion = s.system.motion();
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
  }
  for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) {
    GripperSample& sample = snapshot.grippers[i];
    sample.width_m = s.grippers[i].width(t);
    sample.closed = s.grasping.closed(i);
    sample.commands_applied = s.gripper_commands[i].count;
    sample.newest_stamp_s = s.gripper_commands[i].newest_stamp_s;
  }
}

Explanation Simulation::explain(int component) const {
  Impl& s = *impl_;
  s.refresh_motion();
  Explanation e =
      explain_component(s.model->components, s.interaction, s.system.motion(), s.history, component);
  e.time_s = s.time();
  e.step = s.step_index;
  e.epoch = s.epoch;
  return e;
}

std::uint64_t period_boundary_step(std::uint64_t k, double period_s, double step_s) {
  // The small tolerance keeps k * period / step, when it is a whole number, from being rounded up by its last
  // bit.
  return static_cast<std::uint64_t>(std::ceil(static_cast<double>(k) * period_s / step_s - 1e-6));
}

}  // namespace takt
