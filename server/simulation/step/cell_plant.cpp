#include "server/simulation/step/cell_plant.h"

#include <algorithm>
#include <stdexcept>

#include "plant_models/state_bytes.h"

namespace takt {

CellPlant::CellPlant(const CellModel& model, const ComponentInteraction& interaction,
                     ContactInteraction* contacts)
    : model_(model),
      interaction_(interaction),
      contacts_(contacts),
      robots_(model.robots.begin(), model.robots.end()),
      parts_(model.parts.begin(), model.parts.end()),
      segment_begin_(model.robots.size(), 0) {
  for (const GripperModel& gripper : model.grippers) grippers_.emplace_back(gripper.parameters);
  devices_.resize(model.description.devices.size(), {nullptr, 0});
  for (const AuxiliaryModel& further : model.auxiliary_models) {
    auxiliary_.push_back(further.make());
    if (const auto* element = dynamic_cast<const ForceElement*>(auxiliary_.back().get()))
      force_elements_.push_back(element);
    if (further.device < 0) continue;
    const auto device = static_cast<std::size_t>(further.device);
    auto* with_signals = dynamic_cast<DeviceModel*>(auxiliary_.back().get());
    if (device >= devices_.size() || with_signals == nullptr)
      throw std::invalid_argument("the plant model '" + further.name + "' is said to be device " +
                                  std::to_string(device) +
                                  ", but it is no device, or the device is not described");
    devices_[device] = {with_signals, auxiliary_.size() - 1};
  }
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    if (devices_[i].first == nullptr)
      throw std::invalid_argument("the device '" + model.description.devices[i].name +
                                  "' has no plant model");
  }
  order_carriers();
  if (!carriers_.empty()) movable_.resize(model.components.size(), 0), moving_ = movable_;
  std::vector<char> carried = movable_;
  for (const GroundCarrier* carrier : carriers_) {
    for (const int ground : carrier->carried())
      movable_[static_cast<std::size_t>(ground)] = carried[static_cast<std::size_t>(ground)] = 1;
    if (carrier->belt() >= 0) movable_[static_cast<std::size_t>(carrier->belt())] = 1;
  }
  for (const GroundModel& ground : model.grounds)
    if (carried.empty() || carried[static_cast<std::size_t>(ground.component)] == 0)
      grounds_.emplace_back(ground.component, ground.X_WB);
  for (std::size_t r = 0; r < robots_.size(); ++r) {
    std::vector<const ParallelGripper*> mounted;
    for (const ParallelGripper& gripper : grippers_)
      if (gripper.parameters().robot == static_cast<int>(r)) mounted.push_back(&gripper);
    if (r < model.trajectories.size()) robots_[r].set_trajectory(model.trajectories[r]);
    const std::optional<RobotDynamics> none;
    const std::optional<RobotDynamics>& dynamics = r < model.dynamics.size() ? model.dynamics[r] : none;
    dynamic_.push_back(dynamics ? std::make_unique<DynamicRobot>(dynamics->parameters,
                                                                 make_drives(dynamics->drives), robots_[r],
                                                                 std::move(mounted))
                                : nullptr);
  }
  std::vector<std::size_t> mounted(robots_.size(), 0);
  for (const ParallelGripper& gripper : grippers_) {
    const auto robot = static_cast<std::size_t>(gripper.parameters().robot);
    gripper_place_.emplace_back(robot, mounted[robot]++);
  }
  reset();
}

/// A carrier follows the one that moves the Ground it stands on.
void CellPlant::order_carriers() {
  std::vector<PlantModel*> left;
  for (const auto& model : auxiliary_)
    if (dynamic_cast<const GroundCarrier*>(model.get()) != nullptr) left.push_back(model.get());
  while (!left.empty()) {
    const auto waits = [&left](PlantModel* model) {
      const auto* carrier = dynamic_cast<const GroundCarrier*>(model);
      const int on = carrier->belt() >= 0 ? carrier->belt() : carrier->mount();
      return std::any_of(left.begin(), left.end(), [on](PlantModel* other) {
        const std::span<const int> carried = dynamic_cast<const GroundCarrier*>(other)->carried();
        return std::find(carried.begin(), carried.end(), on) != carried.end();
      });
    };
    const auto next = std::find_if_not(left.begin(), left.end(), waits);
    if (next == left.end())
      throw std::invalid_argument(
          "axes stand on each other in a circle: mounted_on must lead to a ground that stands");
    carrier_models_.push_back(*next);
    carriers_.push_back(dynamic_cast<GroundCarrier*>(*next));
    left.erase(next);
  }
}

void CellPlant::reset() {
  for (KinematicRobot& robot : robots_) robot.reset();
  for (ParallelGripper& gripper : grippers_) gripper.reset();
  for (const auto& further : auxiliary_) further->reset();
  if (!system_) {
    levels_ = model_.robot_levels;
    levels_.resize(robots_.size(), 1);
  }
  if (!system_ || system_->has_stiff_pairs() != system_->has_contacts()) build();
  system_->initial_state(x_);
  accepted_ = x_;
  system_->wake_all();
  system_->reset_counts();
  integrator_->reset();
  energies_.assign(robots_.size(), {});
  forced_.clear();
  now_s_ = 0.0;
}

bool CellPlant::any_dynamic() const {
  return std::any_of(levels_.begin(), levels_.end(), [](int level) { return level > 1; });
}

const SolverParameters& CellPlant::solver() const {
  if (system_->has_contacts()) return model_.contact_solver;
  return model_.dynamics_solver && any_dynamic() ? *model_.dynamics_solver : model_.solver;
}

void CellPlant::build() {
  std::vector<PlantModel*> models;
  // Where something carries Grounds, or robots stand on them, all Grounds come first: others may stand on these. None
  // of them has states.
  const auto add_grounds = [&] {
    for (FixedBody& ground : grounds_) models.push_back(&ground);
  };
  const auto on_ground = [](const GroundCarrier* carrier) { return carrier->mount() >= 0; };
  const bool ride = std::any_of(carriers_.begin(), carriers_.end(), on_ground) ||
                    std::any_of(robots_.begin(), robots_.end(),
                                [](const KinematicRobot& robot) { return robot.parameters().mount >= 0; });
  const bool grounds_first = !carriers_.empty() || ride;
  if (grounds_first) add_grounds();
  models.insert(models.end(), carrier_models_.begin(), carrier_models_.end());
  std::size_t begin = 0;
  for (std::size_t r = 0; r < robots_.size(); ++r) {
    segment_begin_[r] = begin;
    if (levels_[r] == 1) {
      models.push_back(&robots_[r]);
    } else {
      models.push_back(dynamic_[r].get());
      begin += static_cast<std::size_t>(dynamic_[r]->state_count());
    }
  }
  for (ParallelGripper& gripper : grippers_)
    if (levels_[static_cast<std::size_t>(gripper.parameters().robot)] == 1) models.push_back(&gripper);
  auxiliary_begin_ = begin;
  auxiliary_segments_.clear();
  for (const auto& further : auxiliary_) {
    if (std::find(carrier_models_.begin(), carrier_models_.end(), further.get()) == carrier_models_.end())
      models.push_back(further.get());
    auxiliary_segments_.push_back(begin);
    begin += static_cast<std::size_t>(further->state_count());
  }
  if (!grounds_first) add_grounds();
  for (RigidBody& part : parts_) models.push_back(&part);
  parts_begin_ = begin;
  system_ = std::make_unique<OdeSystem>(std::move(models), interaction_, model_.components.size(),
                                        robots_.size(), contacts_);
  system_->set_force_elements(force_elements_);
  const auto moves_surface = [](const GroundCarrier* carrier) { return carrier->belt() >= 0; };
  if (std::any_of(carriers_.begin(), carriers_.end(), moves_surface)) system_->allow_surfaces();
  if (ride) system_->allow_accelerations();
  x_.resize(static_cast<std::size_t>(system_->state_count()));
  accepted_.resize(x_.size());
  system_->set_clock(clock_);
  system_->set_stiff_pairs(system_->has_contacts());
  if (contacts_ != nullptr) contacts_->release();
  integrator_ = make_integrator(solver(), *system_);
}

std::size_t CellPlant::jaw_joint(std::size_t robot, std::size_t place, ParallelGripper::Side side) const {
  return static_cast<std::size_t>(robots_[robot].parameters().arm.joint_count()) + 2 * place +
         static_cast<std::size_t>(side);
}

std::optional<BodyInertia> CellPlant::least_palm_inertia(std::size_t gripper) const {
  const auto [robot, place] = gripper_place_[gripper];
  if (dynamic(robot) == nullptr) return std::nullopt;
  return dynamic(robot)->least_palm_inertia(place);
}

void CellPlant::keep_accepted() {
  for (const OdeSystem::Range& range : system_->active_states())
    std::copy(x_.begin() + static_cast<std::ptrdiff_t>(range.begin),
              x_.begin() + static_cast<std::ptrdiff_t>(range.end),
              accepted_.begin() + static_cast<std::ptrdiff_t>(range.begin));
}

void CellPlant::count_energy(double h) {
  for (std::size_t r = 0; r < robots_.size(); ++r)
    if (levels_[r] > 1)
      energies_[r].electrical_J +=
          dynamic_[r]->electrical_energy_J(h, accepted_.data() + segment_begin_[r], segment(r).data());
}

DynamicRobot::Output CellPlant::robot_output(std::size_t robot, double t, const CellMotion& motion,
                                             std::span<const Wrench> wrenches) const {
  DynamicRobot::Output output = dynamic_[robot]->output(t, segment(robot).data(), motion, wrenches);
  output.power.electrical_energy_J = energies_[robot].electrical_J;
  return output;
}

void CellPlant::read_signals(std::size_t device, double t, std::span<double> signals) const {
  const auto [model, place] = devices_[device];
  model->read_signals(t, x_.data() + auxiliary_segments_[place], system_->motion(), signals);
  for (const ForcedSignal& forced : forced_) {
    const auto signal = static_cast<std::size_t>(forced.ref.signal);
    if (forced.ref.device == static_cast<int>(device) && signal < signals.size())
      signals[signal] = forced.value;
  }
}

double CellPlant::signal_value(SignalRef ref) const {
  for (const ForcedSignal& forced : forced_)
    if (forced.ref == ref) return forced.value;
  const auto device = static_cast<std::size_t>(ref.device), signal = static_cast<std::size_t>(ref.signal);
  if (device >= devices_.size()) return machines_ != nullptr ? machines_->value(ref) : 0.0;
  const auto [model, place] = devices_[device];
  if (const std::span<const double> kept = model->kept_signals(); !kept.empty()) return kept[signal];
  std::array<double, kMaxSignals> all{};
  model->read_signals(now_s_, x_.data() + auxiliary_segments_[place], system_->motion(),
                      std::span(all).first(model_.description.devices[device].signals.size()));
  return all[signal];
}

ForcedSignal* CellPlant::forced(SignalRef ref) {
  const auto found = std::find_if(forced_.begin(), forced_.end(),
                                  [&](const ForcedSignal& forced) { return forced.ref == ref; });
  return found == forced_.end() ? nullptr : &*found;
}

void CellPlant::force(const ForcedSignal& signal) {
  const auto place =
      std::lower_bound(forced_.begin(), forced_.end(), signal,
                       [](const ForcedSignal& a, const ForcedSignal& b) { return a.ref < b.ref; });
  if (place != forced_.end() && place->ref == signal.ref)
    *place = signal;
  else
    forced_.insert(place, signal);
}

void CellPlant::release(SignalRef ref) {
  std::erase_if(forced_, [&](const ForcedSignal& forced) { return forced.ref == ref; });
}

bool CellPlant::decide(double t) {
  bool changed = false;
  for (std::size_t i = 0; i < auxiliary_.size(); ++i)
    changed |= auxiliary_[i]->decide(t, x_.data() + auxiliary_segments_[i], system_->motion());
  if (changed) integrator_->restart();
  return changed;
}

const std::vector<char>& CellPlant::find_moving_grounds(double t) {
  std::fill(moving_.begin(), moving_.end(), 0);
  for (const GroundCarrier* carrier : carriers_) {
    const bool mount_moves =
        carrier->mount() >= 0 && moving_[static_cast<std::size_t>(carrier->mount())] != 0;
    if (!mount_moves && carrier->at_rest(t)) continue;
    for (const int ground : carrier->carried()) moving_[static_cast<std::size_t>(ground)] = 1;
    if (carrier->belt() >= 0) moving_[static_cast<std::size_t>(carrier->belt())] = 1;
  }
  return moving_;
}

void CellPlant::set_clock(double (*now_s)()) {
  clock_ = now_s;
  system_->set_clock(now_s);
}

std::span<const double> CellPlant::segment(std::size_t robot) const {
  const auto count = static_cast<std::size_t>(dynamic_[robot]->state_count());
  return std::span<const double>(x_).subspan(segment_begin_[robot], count);
}

double CellPlant::jaw_coordinate(std::size_t gripper, ParallelGripper::Side side, double t) const {
  const auto [robot, place] = gripper_place_[gripper];
  if (levels_[robot] == 1) return grippers_[gripper].coordinate(t, side);
  return segment(robot)[jaw_joint(robot, place, side)];
}

double CellPlant::jaw_speed(std::size_t gripper, ParallelGripper::Side side, double t) const {
  const auto [robot, place] = gripper_place_[gripper];
  if (levels_[robot] == 1) return grippers_[gripper].speed(t, side);
  return segment(
      robot)[static_cast<std::size_t>(dynamic_[robot]->joint_count()) + jaw_joint(robot, place, side)];
}

void CellPlant::change_levels(std::span<const int> levels, double t) {
  // The motion under the old models.
  const std::vector<double> others(x_.begin() + static_cast<std::ptrdiff_t>(auxiliary_begin_), x_.end());
  struct RobotMotion {
    JointArray q{}, qd{};
  };
  std::vector<RobotMotion> motions(robots_.size());
  for (std::size_t r = 0; r < robots_.size(); ++r) {
    RobotMotion& motion = motions[r];
    if (levels_[r] > 1) {
      const auto n = static_cast<std::size_t>(dynamic_[r]->joint_count());
      std::copy_n(segment(r).data(), n, motion.q.data());
      std::copy_n(segment(r).data() + n, n, motion.qd.data());
    } else {
      robots_[r].joint_state(t, motion.q.data(), motion.qd.data());
    }
  }
  for (std::size_t g = 0; g < grippers_.size(); ++g) {
    const auto [r, place] = gripper_place_[g];
    if (levels_[r] > 1) continue;
    for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right}) {
      motions[r].q[jaw_joint(r, place, side)] = grippers_[g].coordinate(t, side);
      motions[r].qd[jaw_joint(r, place, side)] = grippers_[g].speed(t, side);
    }
  }
  for (std::size_t r = 0; r < robots_.size(); ++r)
    if (levels_[r] > 1)
      energies_[r].mechanical_J = segment(r)[static_cast<std::size_t>(dynamic_[r]->energy_state())];
  const CellMotion motion = system_->motion();
  const std::span<const Wrench> now = system_->update_wrenches();
  const std::vector<Wrench> wrenches(now.begin(), now.end());
  const std::vector<double> old_state = x_;
  const std::vector<std::size_t> old_begin = segment_begin_;
  const std::vector<int> old_levels = levels_;
  levels_.assign(levels.begin(), levels.end());
  build();
  std::copy(others.begin(), others.end(), x_.begin() + static_cast<std::ptrdiff_t>(auxiliary_begin_));
  for (std::size_t r = 0; r < robots_.size(); ++r) {
    double* to = x_.data() + segment_begin_[r];
    if (levels_[r] > 1 && old_levels[r] > 1) {
      std::copy_n(old_state.data() + old_begin[r], dynamic_[r]->state_count(), to);
    } else if (levels_[r] > 1) {
      dynamic_[r]->state_from_motion(t, motions[r].q.data(), motions[r].qd.data(), motion, wrenches, to);
      to[dynamic_[r]->energy_state()] = energies_[r].mechanical_J;
    } else if (old_levels[r] > 1) {
      // The joints were not quite where the reference was: it starts again from where they are.
      robots_[r].continue_from(t, motions[r].q.data(), motions[r].qd.data());
    }
  }
  for (std::size_t g = 0; g < grippers_.size(); ++g) {
    const auto [r, place] = gripper_place_[g];
    if (levels_[r] > 1 || old_levels[r] == 1) continue;
    for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
      grippers_[g].continue_from(t, side, motions[r].q[jaw_joint(r, place, side)]);
  }
  system_->wake_all();
  accepted_ = x_;
}

void CellPlant::save(StateWriter& out) {
  for (const int level : levels_) out.put(static_cast<std::uint8_t>(level));
  for (const RobotEnergy& energy : energies_) out.put(energy.mechanical_J), out.put(energy.electrical_J);
  for (const KinematicRobot& robot : robots_) robot.save(out);
  for (const ParallelGripper& gripper : grippers_) gripper.save(out);
  for (const auto& further : auxiliary_) further->save(out);
  out.put_size(forced_.size());
  for (const ForcedSignal& forced : forced_)
    out.put(forced.ref.device), out.put(forced.ref.signal), out.put(forced.value), out.put(forced.underneath),
        out.put(static_cast<std::uint8_t>(forced.action)), out.put(forced.max_force_N);
  out.put_size(x_.size());
  out.put(std::span<const double>(x_));
  if (integrator_->hides_history()) {
    const SolverStatistics statistics = integrator_->statistics();
    integrator_ = make_integrator(solver(), *system_);
    integrator_->set_statistics(statistics);
  }
  integrator_->forget();
  integrator_->save(out);
}

void CellPlant::load(StateReader& in) {
  for (std::size_t r = 0; r < levels_.size(); ++r) {
    levels_[r] = in.integer(1, 3, "a robot's level of detail");
    if (levels_[r] > 1 && !can_be_dynamic(r))
      in.fail(model_.description.robots[r].name + " has level " + std::to_string(levels_[r]) +
              ", but can only be kinematic");
  }
  for (RobotEnergy& energy : energies_) {
    energy.mechanical_J = in.number("an energy");
    energy.electrical_J = in.number("an energy");
  }
  for (std::size_t r = 0; r < robots_.size(); ++r) {
    robots_[r].load(in);
    if (robots_[r].torque_mode() && levels_[r] == 1) in.fail("a robot in torque mode has level of detail 1");
  }
  for (ParallelGripper& gripper : grippers_) gripper.load(in);
  for (const auto& further : auxiliary_) further->load(in);
  forced_.clear();
  const int owners = signal_owner_count(model_.description);
  for (std::size_t i = in.size(static_cast<std::size_t>(owners * kMaxSignals), "forced signals"); i > 0;
       --i) {
    ForcedSignal forced;
    forced.ref.device = in.integer<int>(0, owners - 1, "the owner of a forced signal");
    const auto signals = signals_of(model_.description, forced.ref.device);
    forced.ref.signal = in.integer<int>(0, static_cast<int>(signals.size()) - 1, "a forced signal");
    forced.value = in.number("a forced value");
    const auto [kind, index] = signal_owner(model_.description, forced.ref.device);
    forced.underneath =
        kind == SignalOwnerKind::gripper
            ? in.number(0.0, grippers_[index].parameters().max_width_m, "a width under a forced signal")
            : in.number("the value under a forced one");
    forced.action = static_cast<GripperAction>(
        in.integer(0, static_cast<int>(GripperAction::width), "the action under a forced signal"));
    forced.max_force_N =
        in.number(0.0, std::numeric_limits<double>::infinity(), "the force under a forced signal");
    force(forced);
  }
  build();
  in.expect_size(x_.size(), "states");
  in.numbers(x_, "a state");
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    double length = 0.0;
    for (std::size_t i = 3; i < 7; ++i) length += x_[part_begin(part) + i] * x_[part_begin(part) + i];
    if (!(length > 0.25 && length < 4.0))
      in.fail("the orientation of " + model_.components[static_cast<std::size_t>(parts_[part].body())].name +
              " is no unit quaternion");
  }
  for (std::size_t r = 0; r < robots_.size(); ++r) {
    if (dynamic(r) == nullptr) continue;
    for (int j = 0; j < dynamic_[r]->joint_count(); ++j) {
      const Drive& drive = dynamic_[r]->drive(j);
      if (!drive.has_modes()) continue;
      const double mode =
          segment(r)[static_cast<std::size_t>(dynamic_[r]->drive_state(j) + drive.mode_state())];
      if (mode != -1.0 && mode != 0.0 && mode != 1.0)
        in.fail("the mode of a friction is " + std::to_string(mode));
    }
  }
  accepted_ = x_;
  integrator_->load(in);
}

void CellPlant::put_part(std::size_t part, const Pose& X_WB, const Twist& V_WB) {
  parts_[part].set_state(X_WB, V_WB, x_.data() + part_begin(part));
  accepted_ = x_;
  integrator_->restart();
}

std::string CellPlant::describe_state(std::size_t state) const {
  if (state >= auxiliary_begin_ && state < parts_begin_) {
    std::size_t place = state - auxiliary_begin_, i = 0;
    while (place >= static_cast<std::size_t>(auxiliary_[i]->state_count()))
      place -= static_cast<std::size_t>(auxiliary_[i++]->state_count());
    return "state " + std::to_string(place) + " of " + model_.auxiliary_models[i].name;
  }
  if (state < parts_begin_) {
    std::size_t robot = 0;
    for (std::size_t r = 0; r < robots_.size(); ++r)
      if (levels_[r] > 1 && segment_begin_[r] <= state) robot = r;
    const DynamicRobot& model = *dynamic_[robot];
    const auto n = static_cast<std::size_t>(model.joint_count());
    const std::size_t place = state - segment_begin_[robot];
    const auto joint = [&](std::size_t i) {
      return " of joint '" + model.tree().model().joints[i].joint.name + "'";
    };
    std::string what = "drive state " + std::to_string(place - std::min(place, 2 * n));
    if (place < n)
      what = "position" + joint(place);
    else if (place < 2 * n)
      what = "velocity" + joint(place - n);
    else if (static_cast<int>(place) >= model.energy_state())
      what = "energy";
    return what + " of " + model_.description.robots[robot].name;
  }
  static constexpr const char* kQuantity[RigidBody::kStates] = {
      "position x",         "position y",         "position z",        "orientation w", "orientation x",
      "orientation y",      "orientation z",      "velocity x",        "velocity y",    "velocity z",
      "angular velocity x", "angular velocity y", "angular velocity z"};
  const std::size_t part = (state - parts_begin_) / RigidBody::kStates;
  return std::string(kQuantity[(state - parts_begin_) % RigidBody::kStates]) + " of " +
         model_.components[static_cast<std::size_t>(model_.parts[part].body)].name;
}

}  // namespace takt
