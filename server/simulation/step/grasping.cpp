#include "server/simulation/step/grasping.h"

#include <algorithm>
#include <optional>

#include "plant_models/state_bytes.h"

namespace takt {

namespace {
// Width of the interval in which the touching position of a jaw is bracketed (m): far below any tolerance of
// a cell.
constexpr double kTouchResolution_m = 1e-8;
// Contact that takes over from substitute forces has this long to build up (s).
constexpr double kTakeOver_s = 0.1;
// Which jaws touch a Part.
constexpr std::uint8_t kLeftJaw = 1, kRightJaw = 2;
bool pressing(const ParallelGripper& jaws) {
  return jaws.blocked(ParallelGripper::left) && jaws.blocked(ParallelGripper::right);
}
void set_volume(GraspState& state, const GripperModel& model, double left_m, double right_m) {
  state.lower_G = Vec3(model.face_x_lower_m, -right_m, model.face_z_lower_m);
  state.upper_G = Vec3(model.face_x_upper_m, left_m, model.face_z_upper_m);
}
}  // namespace

Grasping::Grasping(const CellModel& model) : model_(model) {
  modes_.resize(model.grippers.size(), Mode::open);
  states_.resize(model.grippers.size());
  widths_.resize(model.grippers.size());
  by_contact_.resize(model.grippers.size());
  held_until_s_.resize(model.grippers.size());
  settled_.resize(model.grippers.size());
  taking_.resize(model.grippers.size());
  for (GraspState& state : states_) state.held.reserve(model.parts.size());
  for (auto* list : {&between_, &queue_}) list->reserve(model.parts.size());
  // All components that press on a jaw, with Grounds.
  pressed_.reserve(model.components.size());
  touched_.reserve(model.parts.size());
  seen_.reserve(model.parts.size());
  reset();
}

void Grasping::reset() {
  std::fill(modes_.begin(), modes_.end(), Mode::open);
  for (std::size_t i = 0; i < states_.size(); ++i) {
    states_[i].held.clear();
    states_[i].lower_G = states_[i].upper_G = Vec3::Zero();
    states_[i].palm = model_.grippers[i].parameters.palm;
    widths_[i] = model_.grippers[i].parameters.initial_width_m;
    by_contact_[i] = 0;
    held_until_s_[i] = -1.0;
    settled_[i] = taking_[i] = 0;
  }
}

void Grasping::save(StateWriter& out) const {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    out.put(modes_[i]), out.put(by_contact_[i] != 0), out.put(settled_[i] != 0), out.put(taking_[i] != 0);
    out.put_size(states_[i].held.size());
    for (const int part : states_[i].held) out.put(part);
    out.put(widths_[i]), out.put(held_until_s_[i]);
    out.put(states_[i].lower_G), out.put(states_[i].upper_G);
  }
}

void Grasping::load(StateReader& in) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    modes_[i] = static_cast<Mode>(in.integer(0, static_cast<int>(Mode::close), "a gripper's mode"));
    by_contact_[i] = in.flag("'by contact'") ? 1 : 0;
    settled_[i] = in.flag("'settled'") ? 1 : 0;
    taking_[i] = in.flag("'taking'") ? 1 : 0;
    std::vector<int>& held = states_[i].held;
    held.clear();
    for (std::size_t k = in.size(model_.parts.size(), "held Parts"); k > 0; --k) {
      const int part = in.index(model_.components.size(), "a held Part");
      if (part == -1 || model_.components[static_cast<std::size_t>(part)].type != ComponentType::part ||
          (!held.empty() && held.back() >= part))
        in.fail("what a gripper holds is no Part, or not in order");
      held.push_back(part);
    }
    widths_[i] = in.number(-1e3, 1e3, "a commanded width");
    held_until_s_[i] = in.number("a time");
    states_[i].lower_G = in.vector("a grasp volume");
    states_[i].upper_G = in.vector("a grasp volume");
  }
}

void Grasping::apply(const GripperCommand& command, double t, CellPlant& plant) {
  ParallelGripper& gripper = plant.grippers()[static_cast<std::size_t>(command.gripper)];
  double width = 0.0;
  switch (command.action) {
    case GripperAction::open:
      width = gripper.parameters().max_width_m;
      break;
    case GripperAction::close:
      width = 0.0;
      break;
    case GripperAction::width:
      width = command.width_m;
      break;
  }
  const auto index = static_cast<std::size_t>(command.gripper);
  const double limit_N = command.max_force_N > 0.0 ? command.max_force_N : model_.grippers[index].max_force_N;
  if (gripper.force_limit_N() != limit_N) {
    gripper.limit_force(limit_N);
    if (by_contact_[index] != 0) plant.integrator().restart();
  }
  // Controllers repeat their commands: jaws that travel or press already continue. A rounding error of a
  // jaw's position does not make the command a new one.
  const bool repeated =
      widths_[index] == width && (command.action == GripperAction::close) == (modes_[index] == Mode::close);
  if (by_contact_[index] != 0 && repeated) return;
  const double now = by_contact_[index] != 0 ? plant.width(index, t) : gripper.width(t);
  if (command.action == GripperAction::close) {
    modes_[index] = Mode::close;
  } else if (command.action == GripperAction::width &&
             (width < now || (width == now && modes_[index] != Mode::open))) {
    if (modes_[index] == Mode::open) modes_[index] = Mode::position;  // a held Part stays held
  } else {
    modes_[index] = Mode::open;
  }
  widths_[index] = width;
  if (by_contact_[index] == 0)
    gripper.move_to(t, width);
  else
    drive_jaws(index, t, 0.5 * width, plant);
  if (modes_[index] == Mode::open) {
    states_[index].held.clear();
    settled_[index] = taking_[index] = 0;
  } else if (!repeated && !pressing(gripper)) {  // pressing jaws keep their held Parts
    settled_[index] = 0;
    if (modes_[index] == Mode::close && model_.grippers[index].rule == GraspRule::on_command)
      taking_[index] = 1;
  }
}

int Grasping::part_present(std::size_t gripper) const {
  const std::vector<int>& held = states_[gripper].held;
  return held.empty() || (by_contact_[gripper] == 0 && settled_[gripper] == 0) ? -1 : held.front();
}

double Grasping::grip_force_N(std::size_t gripper, const CellPlant& plant) const {
  const ParallelGripper& jaws = plant.grippers()[gripper];
  const GripperModel& model = model_.grippers[gripper];
  if (part_present(gripper) < 0) return 0.0;
  const double limit_N = std::min(model.max_force_N, jaws.force_limit_N());
  if (modes_[gripper] == Mode::close || !(model.press_m > 0.0)) return limit_N;
  const double beyond_m =
      0.5 * (jaws.target(ParallelGripper::left) + jaws.target(ParallelGripper::right) - widths_[gripper]);
  return std::min(limit_N, model.max_force_N * std::clamp(beyond_m / model.press_m, 0.0, 1.0));
}

void Grasping::drive_jaws(std::size_t gripper, double t, double to_m, CellPlant& plant, double pressing_m) {
  if (modes_[gripper] == Mode::close) to_m = -model_.grippers[gripper].press_m;
  for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
    plant.grippers()[gripper].drive_jaw(t, side, plant.jaw_coordinate(gripper, side, t) - pressing_m, to_m);
}

void Grasping::set_by_contact(std::size_t gripper, bool by_contact, double t, CellPlant& plant) {
  if ((by_contact_[gripper] != 0) == by_contact) return;
  by_contact_[gripper] = by_contact ? 1 : 0;
  held_until_s_[gripper] = -1.0;
  taking_[gripper] = 0;
  if (by_contact) {
    // Jaws that hold a Part only touch it: they press at once, lest it slips through.
    const ParallelGripper& jaws = plant.grippers()[gripper];
    const bool holds = !states_[gripper].held.empty() && pressing(jaws);
    if (holds) held_until_s_[gripper] = t + kTakeOver_s;
    drive_jaws(gripper, t, 0.5 * widths_[gripper], plant, holds ? model_.grippers[gripper].press_m : 0.0);
    return;
  }
  // They continue to their target, and stop at once if they touch already.
  settled_[gripper] = 0;
  for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
    plant.grippers()[gripper].drive_jaw(t, side, plant.jaw_coordinate(gripper, side, t),
                                        0.5 * widths_[gripper]);
}

void Grasping::stop_jaws(std::size_t gripper, double t, double h, const CellMotion& motion,
                         ParallelGripper& jaws, ComponentInteraction& interaction) {
  const ParallelGripperParameters& parameters = model_.grippers[gripper].parameters;
  const Pose& X_WG = motion.bodies[static_cast<std::size_t>(parameters.palm)].X_WB;
  for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right}) {
    if (!jaws.closing(t, side)) continue;
    const int jaw = parameters.jaws[static_cast<std::size_t>(side)];
    const double now = jaws.coordinate(t, side), next = jaws.coordinate(t + h, side);
    std::optional<double> stop;  // where it meets the first of them
    const auto pose_at = [&](double coordinate) {
      return X_WG * ParallelGripper::jaw_pose(side, coordinate);
    };
    for (const int part : interaction.parts_near_sweep(jaw, pose_at(now), pose_at(next))) {
      CollisionWorld& world = interaction.collision_world();
      const auto touches = [&](double coordinate) {
        return world.overlaps_at(jaw, pose_at(coordinate), part, interaction.counts());
      };
      double free = now;
      double blocked = stop.value_or(next);
      if (!touches(blocked)) continue;
      if (touches(free)) {  // already there (a Part moved into the jaw): stay
        blocked = free;
      }
      while (free - blocked > kTouchResolution_m) {
        const double middle = 0.5 * (free + blocked);
        (touches(middle) ? blocked : free) = middle;
      }
      stop = free;
    }
    if (stop) jaws.stop_jaw(t, side, *stop);
  }
}

bool Grasping::reaches(const ContactGraph& graph, std::size_t from, std::size_t without, std::uint8_t jaws) {
  std::fill(seen_.begin(), seen_.end(), 0);
  queue_.assign(1, static_cast<int>(from));
  seen_[from] = 1;
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    const auto at = static_cast<std::size_t>(queue_[i]);
    if ((touched_[at] & jaws) != 0) return true;
    const std::vector<int>& near = graph.neighbours[static_cast<std::size_t>(between_[at])];
    for (std::size_t next = 0; next < between_.size(); ++next) {
      if (next == without || seen_[next] != 0 ||
          !std::binary_search(near.begin(), near.end(), between_[next]))
        continue;
      seen_[next] = 1;
      queue_.push_back(static_cast<int>(next));
    }
  }
  return false;
}

void Grasping::clamp(const ContactGraph& graph, std::vector<int>& held) {
  constexpr std::uint8_t both = kLeftJaw | kRightJaw;
  held.clear();
  for (std::size_t i = 0; i < between_.size(); ++i)
    if (touched_[i] == both) held.push_back(between_[i]);
  if (!held.empty()) return;
  // Clamped together: two paths without a common Part lead from the Part to the two jaws. By Menger's theorem
  // they exist if no single Part or jaw lies on all paths.
  seen_.resize(between_.size());
  for (std::size_t i = 0; i < between_.size(); ++i) {
    bool clamped = reaches(graph, i, i, kLeftJaw) && reaches(graph, i, i, kRightJaw);
    for (std::size_t other = 0; clamped && other < between_.size(); ++other)
      clamped = other == i || reaches(graph, i, other, both);
    if (clamped) held.push_back(between_[i]);
  }
}

void Grasping::settle(std::size_t gripper, double t, const CellMotion& motion, const ParallelGripper& jaws,
                      ComponentInteraction& interaction) {
  GraspState& state = states_[gripper];
  settled_[gripper] = 1;
  if (!pressing(jaws)) {
    state.held.clear();
    return;
  }
  const Pose& X_WG = motion.bodies[static_cast<std::size_t>(state.palm)].X_WB;
  const std::span<const int> between = interaction.parts_between(state.palm, state.lower_G, state.upper_G);
  between_.assign(between.begin(), between.end());
  touched_.assign(between_.size(), 0);
  for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right}) {
    const int jaw = model_.grippers[gripper].parameters.jaws[static_cast<std::size_t>(side)];
    const Pose X_WJ = X_WG * ParallelGripper::jaw_pose(side, jaws.coordinate(t, side));
    for (std::size_t i = 0; i < between_.size(); ++i)
      if (interaction.collision_world().touches_at(jaw, X_WJ, between_[i], interaction.counts()))
        touched_[i] |= side == ParallelGripper::left ? kLeftJaw : kRightJaw;
  }
  clamp(interaction.graph(), state.held);
}

void Grasping::hold_by_contact(std::size_t gripper, double t, const CellMotion& motion, CellPlant& plant,
                               ComponentInteraction& interaction, ContactInteraction& contacts) {
  const GripperModel& model = model_.grippers[gripper];
  GraspState& state = states_[gripper];
  const std::array<int, 2>& ids = model.parameters.jaws;
  const Pose& X_WG = motion.bodies[static_cast<std::size_t>(state.palm)].X_WB;
  if (modes_[gripper] == Mode::open) return;
  const double left_m = plant.jaw_coordinate(gripper, ParallelGripper::left, t);
  const double right_m = plant.jaw_coordinate(gripper, ParallelGripper::right, t);
  // Jaws that meet: each holds the force of the other's drive.
  ParallelGripper& jaws = plant.grippers()[gripper];
  if (left_m + right_m <= 0.0 &&
      jaws.target(ParallelGripper::left) + jaws.target(ParallelGripper::right) < 0.0) {
    const double middle_m = 0.5 * (left_m - right_m);
    jaws.drive_jaw(t, ParallelGripper::left, left_m, middle_m);
    jaws.drive_jaw(t, ParallelGripper::right, right_m, -middle_m);
    plant.integrator().restart();
  }
  between_.clear();
  touched_.clear();
  const auto touch = [this](int part, std::uint8_t jaw) {
    const auto place = std::lower_bound(between_.begin(), between_.end(), part);
    const auto at = place - between_.begin();
    if (place == between_.end() || *place != part) {
      between_.insert(place, part);
      touched_.insert(touched_.begin() + at, 0);
    }
    touched_[static_cast<std::size_t>(at)] |= jaw;
  };
  for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right}) {
    const Vec3 inwards_W = X_WG.R.col(1) * (side == ParallelGripper::left ? -1.0 : 1.0);
    contacts.list_pushed(motion, ids[static_cast<std::size_t>(side)], inwards_W, pressed_);
    for (const int part : pressed_)
      if (model_.components[static_cast<std::size_t>(part)].type == ComponentType::part)
        touch(part, side == ParallelGripper::left ? kLeftJaw : kRightJaw);
  }
  if (between_.empty() && state.held.empty()) return;
  set_volume(state, model, left_m, right_m);
  const auto has = [this](std::uint8_t jaw) {
    return std::find_if(touched_.begin(), touched_.end(),
                        [jaw](std::uint8_t touched) { return (touched & jaw) != 0; }) != touched_.end();
  };
  const bool directly = std::find(touched_.begin(), touched_.end(), kLeftJaw | kRightJaw) != touched_.end();
  if (!directly && has(kLeftJaw) && has(kRightJaw))  // possibly through other Parts between them
    for (const int part : interaction.parts_between(state.palm, state.lower_G, state.upper_G)) touch(part, 0);
  clamp(interaction.graph(), pressed_);
  if (pressed_.empty() && t < held_until_s_[gripper]) return;
  held_until_s_[gripper] = -1.0;
  state.held.assign(pressed_.begin(), pressed_.end());
}

void Grasping::update(double t, double h, const CellMotion& motion, CellPlant& plant,
                      ComponentInteraction& interaction, ContactInteraction& contacts) {
  for (std::size_t i = 0; i < plant.grippers().size(); ++i) {
    if (by_contact_[i] != 0) {
      hold_by_contact(i, t, motion, plant, interaction, contacts);
      continue;
    }
    if (modes_[i] == Mode::open) continue;
    ParallelGripper& jaws = plant.grippers()[i];
    GraspState& state = states_[i];
    stop_jaws(i, t, h, motion, jaws, interaction);
    std::erase_if(state.held, [&](int part) { return !interaction.gripped(part, state.palm); });
    if (settled_[i] != 0 && state.held.empty()) continue;
    set_volume(state, model_.grippers[i], jaws.coordinate(t, ParallelGripper::left),
               jaws.coordinate(t, ParallelGripper::right));
    if (taking_[i] != 0) {
      const std::span<const int> taken = interaction.parts_between(state.palm, state.lower_G, state.upper_G);
      state.held.assign(taken.begin(), taken.end());
      taking_[i] = 0;
    }
    if (settled_[i] == 0 && !jaws.moving(t)) settle(i, t, motion, jaws, interaction);
  }
}

PartState part_state(const std::vector<Component>& components, const ContactGraph& graph, int component,
                     int partner) {
  const Component& self = components[static_cast<std::size_t>(component)];
  if (self.type != ComponentType::part) return PartState::fixed;
  if (partner >= 0 && components[static_cast<std::size_t>(partner)].type == ComponentType::gripper) {
    return PartState::grasped;
  }
  for (const int neighbour : graph.neighbours[static_cast<std::size_t>(component)]) {
    const Component& other = components[static_cast<std::size_t>(neighbour)];
    if (other.type == ComponentType::part && other.hierarchy != self.hierarchy) return PartState::assembled;
  }
  if (partner >= 0 && components[static_cast<std::size_t>(partner)].type == ComponentType::ground) {
    return PartState::placed;
  }
  return PartState::free;
}

}  // namespace takt
