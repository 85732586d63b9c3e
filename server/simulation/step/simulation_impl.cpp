#include "server/simulation/step/simulation_impl.h"

#include <array>
#include <cmath>
#include <sstream>
#include <variant>

namespace takt {

namespace {
// Far above all values of a cell; quantities derived from a smaller state (powers, energies, loads) are
// finite.
constexpr double kLargestState = 1e30;

std::vector<int> part_bodies(const CellModel& cell) {
  std::vector<int> result;
  for (const RigidBodyParameters& part : cell.parts) result.push_back(part.body);
  return result;
}
}  // namespace

Simulation::Impl::Impl(std::shared_ptr<const CellModel> cell_model)
    : model(std::move(cell_model)),
      interaction(model->components, model->pairs, model->interaction),
      contacts(model->components, model->contact),
      grasping(*model),
      grip_loads(*model),
      alternation(*model),
      plant(*model, interaction, &contacts),
      signals(*model, plant, grasping),
      exact_sleeping(model->components, part_bodies(*model)),
      threshold_sleeping(model->components, model->contact.sleeping, model->step_s, contacts, exact_sleeping),
      orientations(model->components.size()),
      part_hashes(model->parts.size(), 0),
      robot_commands(model->robots.size()),
      gripper_commands(model->grippers.size()),
      device_commands(model->description.devices.size()),
      watch(*model),
      history(model->components.size()) {
  for (const MechanismModel& mechanism : model->mechanisms) mechanisms.push_back(mechanism.make());
  for (std::size_t d = 0; d < model->description.devices.size(); ++d)
    if (const auto* hashed = dynamic_cast<const HashedState*>(&plant.device(d)))
      hashed_devices.push_back(hashed);
  changes.reserve(2 * model->parts.size());
  device_notices.reserve(model->description.devices.size() + 2 * model->parts.size());
  motion_notices.reserve(ReferenceMotion::kMaxNotices * model->robots.size());
  for (std::size_t r = 0; r < model->robots.size(); ++r)
    reference_motions.emplace_back(model->description, r, plant.robots()[r], motion_notices);
  if (!plant.carriers().empty()) {
    interaction.allow_sliding();
    contacts.set_movable_grounds(plant.movable_grounds());
  }
  if (model->clearance.enabled) {
    monitor =
        std::make_unique<ClearanceMonitor>(model->clearance, base_poses(*model), model->components.size());
    collisions.reserve(4 * model->clearance.pairs.size());
  }
  start();
}

void Simulation::Impl::start() {
  step_index = 0;
  interaction.reset();
  contacts.reset();
  for (const auto& mechanism : mechanisms) mechanism->start(interaction);
  mechanism_let_go = false;
  if (process_levels.empty()) {
    for (const ProcessDescription& process : model->description.processes)
      process_levels.push_back(process.level_of_detail);
  }
  choose_forces();
  plant.reset();
  park_pools();
  exact_sleeping.wake_all();
  threshold_sleeping.wake_all();
  std::fill(part_hashes.begin(), part_hashes.end(), 0);
  parts_hash = 0;
  grasping.reset();
  grip_loads.reset();
  alternation.reset();
  hash.reset();
  fault.clear();
  changes.clear();
  device_messages.clear();
  collisions.clear();
  device_notices.clear();
  if (monitor) monitor->reset();
  history.reset();
  watch.reset();
  start_overlaps.assign(model->start_overlaps.size(), 1);
  statistics = {};
  for (auto& counter : robot_commands) counter = {};
  for (auto& counter : gripper_commands) counter = {};
  for (auto& counter : device_commands) counter = {};
  for (ReferenceMotion& motion : reference_motions) motion.reset();
  motion_notices.clear();
  refused.assign(model->robots.size(), 0);
  torques_refused.assign(model->robots.size(), 0);
  torques_before.assign(model->robots.size(), std::nullopt);
  plant.allow_motion(true);
  plant.set_speed_override(1.0);
  motion_is_current = false;
  choose_grippers();
  note_yielding();
  decide();
  update_connections();  // so that reports at the start contain the holders
}

std::vector<int> Simulation::Impl::component_levels() const {
  std::vector<int> levels(model->components.size(), 1);
  for (std::size_t p = 0; p < process_levels.size(); ++p)
    for (const int member : model->description.processes[p].components) {
      int& level = levels[static_cast<std::size_t>(member)];
      level = std::max(level, process_levels[p]);
    }
  return levels;
}

void Simulation::Impl::choose_forces() {
  std::vector<int> levels = component_levels();
  for (const auto& mechanism : mechanisms)
    mechanism->choose_stiffness(
        [&levels](int component) { return levels[static_cast<std::size_t>(component)] == 3; }, interaction);
  if (!model->contact.enabled) return;
  for (std::size_t c = 0; c < levels.size(); ++c)
    if (model->components[c].type == ComponentType::ground) levels[c] = 3;
  const auto acts = [&](int a, int b) {
    return levels[static_cast<std::size_t>(a)] == 3 && levels[static_cast<std::size_t>(b)] == 3 &&
           model->contact.pairs.kind(a, b).force != PairForce::substitute && !interaction.attached(a, b);
  };
  contacts.set_acting(acts);
  interaction.set_by_contact(acts);
  if (monitor) monitor->set_by_contact(acts);
}

void Simulation::Impl::choose_grippers() {
  if (!model->contact.enabled) return;
  const std::vector<int> levels = component_levels();
  for (std::size_t g = 0; g < model->grippers.size(); ++g) {
    const auto palm = static_cast<std::size_t>(model->grippers[g].parameters.palm);
    grasping.set_by_contact(g, levels[palm] == 3, time(), plant);
  }
}

void Simulation::Impl::regroup(const std::vector<int>& robot_levels) {
  refresh_motion();
  choose_forces();
  plant.change_levels(robot_levels, time());
  exact_sleeping.wake_all();
  threshold_sleeping.wake_all();
  alternation.pause();
  motion_is_current = false;
  choose_grippers();
  note_yielding();
  interaction.reconsider_attached();
  find_near();
}

void Simulation::Impl::note_yielding() {
  for (std::size_t g = 0; g < model->grippers.size(); ++g)
    interaction.set_yielding(model->grippers[g].parameters.palm, plant.least_palm_inertia(g));
}

void Simulation::Impl::find_near() {
  if (!contacts.any_acting()) return;
  refresh_motion();
  contacts.update(system().motion(), model->step_s);
}

void Simulation::Impl::wake_all() {
  exact_sleeping.wake_all();
  threshold_sleeping.wake_all();
  system().wake_all();
}

void Simulation::Impl::refresh_motion() {
  if (motion_is_current) return;
  system().update_motion(time(), plant.state());
  motion_is_current = true;
}

void Simulation::Impl::apply(const JointCommand& command) {
  const auto robot = static_cast<std::size_t>(command.robot);
  const RobotDescription& description = model->description.robots[robot];
  // Commands are validated at the boundary; this is the second line of defence, for callers that make their
  // own.
  for (std::size_t j = 0; j < description.arm.joints.size(); ++j) {
    if (std::isfinite(command.position[j]) && std::isfinite(command.velocity[j]) &&
        std::isfinite(command.effort[j]))
      continue;
    fault = "the set-point of joint '" + description.arm.joints[j].name + "' of " + description.name +
            " at t = " + std::to_string(time()) +
            " s is not a finite number; the last accepted state is kept.";
    return;
  }
  if (refuses(robot, false) || (command.torque_mode && refuses_torques(robot))) return;
  if (command.torque_mode) {
    const std::span<const double> x = plant.segment(robot);
    const auto joints = static_cast<std::size_t>(plant.dynamic(robot)->joint_count());
    reference_motions[robot].apply_torques(command, time(), step_index, x.data(), x.data() + joints);
  } else {
    reference_motions[robot].apply(command, time(), step_index);
  }
  torques_refused[robot] = 0;
  robot_commands[robot].note(command.stamp);
}

bool Simulation::Impl::refuses(std::size_t robot, bool each_time) {
  if (plant.motion_allowed()) return false;
  if (each_time || refused[robot] == 0) {
    MotionNotice notice{.kind = MotionNotice::Kind::motion_refused};
    notice.time_s = time(), notice.step = step_index, notice.robot = static_cast<int>(robot);
    motion_notices.push_back(notice);
  }
  refused[robot] = 1;
  return true;
}

void Simulation::Impl::apply(const GripperCommand& command) {
  if (!plant.motion_allowed()) return;  // grippers hold what they hold
  signals.apply(command, time());
  gripper_commands[static_cast<std::size_t>(command.gripper)].note(command.stamp);
}

void Simulation::Impl::apply(const TrajectoryCommand& command) {
  const auto robot = static_cast<std::size_t>(command.robot);
  if (!command.path->points.empty() && refuses(robot, true)) return;
  reference_motions[robot].apply(command, time(), step_index);
  robot_commands[robot].note(command.stamp);
}

/// Inputs enter the motion too: a torque on a joint, a heat flow.
void Simulation::Impl::input_changed() {
  plant.integrator().restart();
  motion_is_current = false;
}

void Simulation::Impl::apply(const DeviceCommand& command) {
  const auto device = static_cast<std::size_t>(command.device);
  // Controllers repeat unchanged values: only a changed value is a jump of the right-hand side.
  std::array<double, kMaxSignals> present{};
  refresh_motion();
  plant.read_signals(device, time(), std::span(present));
  bool jumps = false;
  for (int i = 0; i < command.count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const SignalRef ref{command.device, command.signals[at]};
    if (ForcedSignal* forced = plant.forced(ref)) {
      forced->underneath = command.values[at];
      continue;
    }
    if (present[command.signals[at]] == command.values[at]) continue;
    plant.device(device).set_signal(time(), command.signals[at], command.values[at]);
    jumps = true;
  }
  if (jumps) input_changed();
  device_commands[device].note(command.stamp);
}

void Simulation::Impl::decide() {
  if (mechanism_let_go) changed_holds();
  mechanism_let_go = false;
  if (model->auxiliary_models.empty()) return;
  refresh_motion();
  if (plant.decide(time())) motion_is_current = false;
  if (step_index > 0) device_messages.clear();
  for (std::size_t d = 0; d < model->description.devices.size(); ++d)
    if (std::string said = plant.device(d).take_message(); !said.empty())
      device_messages.push_back({time(), step_index, static_cast<int>(d), std::move(said)});
  contacts.update_friction(system().motion().heat);
}

void Simulation::Impl::update_connections() {
  refresh_motion();
  interaction.update_poses(system().motion(), system().active_bodies(), clock);
  if (interaction.refused_pose() >= 0) {
    // States are finite (accept()), but quantities derived from them may overflow.
    fault = "the pose of " + model->components[static_cast<std::size_t>(interaction.refused_pose())].name +
            " became non-finite at t = " + std::to_string(time()) +
            " s; the last accepted state is kept. A smaller step may help.";
    return;
  }
  if (contacts.any_acting()) {
    contacts.accept(system().motion());
    contacts.update(system().motion(), model->step_s);
    alternation.update(time(), step_index, system().motion(), contacts);
  }
  grasping.update(time(), model->step_s, system().motion(), plant, interaction, contacts);
  interaction.update_connections(system().motion(), grasping.states(), clock);
  grip_loads.update(time(), step_index, system().motion(), interaction, grasping, plant);
  for (const auto& mechanism : mechanisms)
    mechanism_let_go |= mechanism->update(model->step_s, system().motion(), plant, interaction);
  note_devices();
  history.note(time(), step_index, interaction.changes());
  bool changed = exact_sleeping.wake_changed(interaction);
  if (!plant.carriers().empty()) {
    const std::vector<char>& moving = plant.find_moving_grounds(time());
    changed |= exact_sleeping.wake_carried(interaction, moving);
    threshold_sleeping.set_moving_grounds(moving);
  }
  const bool reached = contacts.any_acting() && threshold_sleeping.wake_reached(system().motion());
  if (changed || reached) system().set_awake(exact_sleeping.awake());
  if (reached || !interaction.disturbed().empty()) plant.integrator().restart();
  // Changes at the initial state belong to the first step.
  if (step_index > 0) changes.clear();
  for (const PartnerChange& change : interaction.changes()) {
    changes.push_back({time(), step_index, change.part, change.from, change.to});
  }
  if (monitor) check_clearances();
  if (std::string why =
          watch.look(time(), exact_sleeping.awake_indices(), system().motion(), interaction, plant);
      !why.empty())
    fault = std::move(why);
}

void Simulation::Impl::check_clearances() {
  const double begin = clock != nullptr ? clock() : 0.0;
  monitor->update(time(), step_index, system().motion(), system().active_bodies(), interaction.changes());
  if (step_index > 0) collisions.clear();
  collisions.insert(collisions.end(), monitor->events().begin(), monitor->events().end());
  if (clock != nullptr) statistics.clearance_s += clock() - begin;
}

bool Simulation::Impl::accept() {
  const std::vector<double>& x = plant.state();
  for (const OdeSystem::Range& range : system().active_states()) {
    for (std::size_t i = range.begin; i < range.end; ++i)
      if (!(std::abs(x[i]) < kLargestState)) return diverged(i);
  }
  plant.count_energy(model->step_s);
  ++step_index;
  statistics.part_steps_skipped += model->parts.size() - exact_sleeping.awake().size();
  hash_parts();
  // A force element may set a Part at rest in motion.
  const bool may_sleep = plant.force_elements().empty();
  if (may_sleep && model->interaction.exact_sleeping && plant.integrator().fixed_step() &&
      !contacts.any_acting())
    rest();
  if (may_sleep && model->contact.sleeping.enabled && plant.integrator().one_step() &&
      contacts.any_acting()) {
    refresh_motion();
    if (threshold_sleeping.fall_asleep(interaction, system().motion()))
      system().set_awake(exact_sleeping.awake());
  }
  hash_robots();
  return true;
}

void Simulation::Impl::hash_robots() {
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
  if (!model->auxiliary_models.empty()) hash.add(plant.auxiliary_states());
  for (const HashedState* device : hashed_devices) hash.add(device->discrete_hash());
  for (const GroundCarrier* carrier : plant.carriers()) hash.add(carrier->coordinate(time()));
  for (const ParallelGripper& gripper : plant.grippers()) {
    hash.add(gripper.coordinate(time(), ParallelGripper::left));
    hash.add(gripper.coordinate(time(), ParallelGripper::right));
  }
  hash_signals();
}

void Simulation::Impl::hash_signals() {
  for (std::size_t i = 0; i < device_commands.size(); ++i) hash.add(plant.device(i).kept_signals());
  for (const ForcedSignal& forced : plant.forced_signals()) {
    hash.add(static_cast<std::uint64_t>(forced.ref.device) << 32U |
             static_cast<std::uint64_t>(forced.ref.signal));
    hash.add(forced.value);
    hash.add(forced.underneath);
  }
}

void Simulation::Impl::hash_parts() {
  for (const int i : exact_sleeping.awake_indices()) {
    const auto part = static_cast<std::size_t>(i);
    StateHash own;
    own.add(static_cast<std::uint64_t>(part));
    own.add(std::span<const double>(plant.state()).subspan(plant.part_begin(part), RigidBody::kStates));
    const int body = model->parts[part].body;
    const int partner = interaction.partner(body);
    own.add(static_cast<std::uint64_t>(partner + 1));
    if (const int attached_to = interaction.attached_to(body); attached_to != -1)
      own.add(~static_cast<std::uint64_t>(attached_to));
    for (const PairConnection& pair : interaction.connections_of(body))
      if (pair.connection.partner != partner)
        own.add(static_cast<std::uint64_t>(pair.connection.partner + 1));
    parts_hash += own.value() - part_hashes[part];
    part_hashes[part] = own.value();
  }
  hash.add(parts_hash);
}

void Simulation::Impl::rest() {
  const auto parts_of = [this](const std::vector<double>& x) {
    return std::span<const double>(x).subspan(plant.parts_begin());
  };
  if (!exact_sleeping.rest_unchanged(interaction, parts_of(plant.accepted()), parts_of(plant.state())))
    return;
  // The motion is still that of the solver's last trial; Parts at rest keep theirs.
  system().update_motion(time(), plant.state());
  system().set_awake(exact_sleeping.awake());
}

bool Simulation::Impl::overlaps_at_start() {
  if (step_index > 0) return false;
  const auto count = std::count(start_overlaps.begin(), start_overlaps.end(), 1);
  if (count == 0) return false;
  const auto first = std::find(start_overlaps.begin(), start_overlaps.end(), 1) - start_overlaps.begin();
  fault = model->start_overlaps[static_cast<std::size_t>(first)].sentence;
  if (count > 1) fault += " (" + std::to_string(count - 1) + " more pairs overlap.)";
  return true;
}

bool Simulation::Impl::step(std::span<const Command> commands) {
  if (overlaps_at_start()) return false;
  plant.set_time(time());
  // 1 apply commands and wires
  motion_notices.clear();
  follow_torques();
  for (const Command& command : commands) {
    std::visit([this](const auto& c) { apply(c); }, command);
  }
  if (!fault.empty()) return false;
  if (!model->description.wires.empty()) {
    refresh_motion();
    if (signals.follow_wires(time())) input_changed();
  }
  begin_mechanisms();
  for (ReferenceMotion& motion : reference_motions) {
    if (!plant.motion_allowed()) motion.stop(time(), step_index);
    motion.advance(time(), step_index, watch_deadlines, plant.speed_override());
  }
  set_torques();
  decide();
  // 2 update connections
  const auto now = [this] { return clock != nullptr ? clock() : 0.0; };
  const double t0 = now();
  update_connections();
  if (!fault.empty()) return false;
  // Their places are known to all: parked Parts cost nothing from here on.
  if (exact_sleeping.any_parked() && system().awake_count() != exact_sleeping.awake().size())
    system().set_awake(exact_sleeping.awake());
  const double t1 = now();
  // 3 integrate t -> t + h
  plant.keep_accepted();
  const bool arrived = integrate();
  motion_is_current = false;
  if (!fault.empty()) return fall_back();
  // 4 check and count
  const double t2 = now();
  statistics.connections_s += t1 - t0;
  statistics.integration_s += t2 - t1;
  return arrived ? accept() : solver_failed();
}

// In pieces where bodies in surface contact are so fast that one piece would carry them through a wall.
bool Simulation::Impl::integrate() {
  constexpr double kMaxPieces = 10000.0;
  const double step_s = model->step_s;
  if (!contacts.any_acting()) return plant.integrator().advance(system(), time(), step_s, plant.state());
  double done_s = 0.0;
  while (true) {
    const double left_s = step_s - done_s;
    const double seeing_s = contacts.seeing_step_s(system().motion(), left_s);
    const double pieces = std::min(std::ceil(left_s / seeing_s), kMaxPieces);
    const bool last = !(pieces > 1.0);
    const double piece_s = last ? left_s : left_s / pieces;
    if (!plant.integrator().advance(system(), time() + done_s, piece_s, plant.state())) return false;
    done_s += piece_s;
    system().update_motion(time() + done_s, plant.state());
    if (const auto found = contacts.passing(system().motion()); found.base >= 0) {
      fault = passing_text(found);
      return true;
    }
    if (last) return true;
  }
}

std::string Simulation::Impl::passing_text(const ContactInteraction::Passing& found) const {
  const auto name = [this](int component) {
    return model->components[static_cast<std::size_t>(component)].name;
  };
  std::ostringstream text;
  text << name(found.base) << " passes through " << name(found.target) << " after t = " << time()
       << " s: it is " << 1e3 * found.depth_m << " mm deep where " << name(found.target) << " is at most "
       << 1e3 * found.wall_m << " mm thick, at " << found.speed_m_per_s
       << " m/s; the last accepted state is kept. The elastic layer of the pair is too soft for this impact: "
          "a slower approach, or a larger contact youngs_modulus_Pa or a smaller layer_depth_m of the pair.";
  return text.str();
}

bool Simulation::Impl::diverged(std::size_t state) {
  const std::string& solver = plant.solver().name;
  const bool explicit_at_dynamics =
      solver_is_explicit(solver) && !system().has_contacts() && plant.any_dynamic();
  const bool at_contact = system().has_contacts() && solver != "rosenbrock" && solver != kAutomaticSolver;
  fault = "the state diverged in the step from t = " + std::to_string(time()) +
          " s: " + plant.describe_state(state) + " (state " + std::to_string(state) +
          "); the last accepted state is kept. " +
          (explicit_at_dynamics ? "A smaller step may help, or solver.dynamics: {method: implicit}: explicit "
                                  "steps must be short where a dynamic robot holds what is heavy."
           : at_contact ? "solver.contact: {method: automatic} follows surface contact with error control."
                        : "A smaller step may help.");
  return fall_back();
}

bool Simulation::Impl::solver_failed() {
  if (plant.integrator().fixed_step()) {
    // The name of the state makes the message more exact.
    for (const OdeSystem::Range& range : system().active_states())
      for (std::size_t i = range.begin; i < range.end; ++i)
        if (!std::isfinite(plant.state()[i])) return diverged(i);
  }
  fault = "the solver " + plant.solver().name + " failed in the step from t = " + std::to_string(time()) +
          " s: " + plant.integrator().failure() + "; the last accepted state is kept.";
  return fall_back();
}

bool Simulation::Impl::fall_back() {
  plant.state() = plant.accepted();
  motion_is_current = false;
  return false;
}

}  // namespace takt
