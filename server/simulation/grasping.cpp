#include "server/simulation/grasping.h"

#include <algorithm>

#include "plant_models/state_bytes.h"

namespace takt {

namespace {
// Width of the interval in which the touching position of a jaw is bracketed (m): far below any tolerance of
// a cell.
constexpr double kTouchResolution_m = 1e-8;
// Contact that takes over from substitute forces has this long to build up (s).
constexpr double kTakeOver_s = 0.1;
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
  reset();
}

void Grasping::reset() {
  std::fill(modes_.begin(), modes_.end(), Mode::open);
  for (std::size_t i = 0; i < states_.size(); ++i) {
    states_[i] = {};
    states_[i].palm = model_.grippers[i].parameters.palm;
    widths_[i] = model_.grippers[i].parameters.initial_width_m;
    by_contact_[i] = 0;
    held_until_s_[i] = -1.0;
  }
}

void Grasping::save(StateWriter& out) const {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    out.put(modes_[i]), out.put(by_contact_[i] != 0), out.put(states_[i].active);
    out.put(widths_[i]), out.put(held_until_s_[i]);
    out.put(states_[i].lower_G), out.put(states_[i].upper_G);
  }
}

void Grasping::load(StateReader& in) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    modes_[i] = static_cast<Mode>(in.integer(0, static_cast<int>(Mode::close), "a gripper's mode"));
    by_contact_[i] = in.flag("'by contact'") ? 1 : 0;
    states_[i].active = in.flag("'holds'");
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
  const Mode before = modes_[index];
  const double now = by_contact_[index] != 0 ? plant.width(index, t) : gripper.width(t);
  if (command.action == GripperAction::close) {
    modes_[index] = Mode::close;
  } else if (command.action == GripperAction::width &&
             (width < now || (width == now && modes_[index] != Mode::open))) {
    if (modes_[index] == Mode::open) modes_[index] = Mode::position;  // a held Part stays held
  } else {
    modes_[index] = Mode::open;
  }
  // Controllers repeat their commands: jaws that are under way or press already go on as they do.
  const bool repeated = modes_[index] == before && widths_[index] == width;
  widths_[index] = width;
  if (by_contact_[index] == 0)
    gripper.move_to(t, width);
  else if (!repeated)
    drive_jaws(index, t, 0.5 * width, plant);
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
  if (by_contact) {
    // Jaws that hold a Part only touch it: they press at once, lest it slips through.
    const ParallelGripper& jaws = plant.grippers()[gripper];
    const bool touching = jaws.blocked(ParallelGripper::left) && jaws.blocked(ParallelGripper::right);
    const bool holds = states_[gripper].active && touching;
    if (holds) held_until_s_[gripper] = t + kTakeOver_s;
    drive_jaws(gripper, t, 0.5 * widths_[gripper], plant, holds ? model_.grippers[gripper].press_m : 0.0);
    return;
  }
  // They go on to where they were sent, and stop at once where they touch already.
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
    const auto pose_at = [&](double coordinate) {
      return X_WG * ParallelGripper::jaw_pose(side, coordinate);
    };
    for (const int part : interaction.parts_near_sweep(jaw, pose_at(jaws.coordinate(t, side)),
                                                       pose_at(jaws.coordinate(t + h, side)))) {
      CollisionWorld& world = interaction.world();
      const auto touches = [&](double coordinate) {
        return world.overlaps_at(jaw, pose_at(coordinate), part, interaction.counts());
      };
      double free = jaws.coordinate(t, side);
      double blocked = jaws.coordinate(t + h, side);
      if (!touches(blocked)) continue;
      if (touches(free)) {  // already there (a Part moved into the jaw): stay
        blocked = free;
      }
      while (free - blocked > kTouchResolution_m) {
        const double middle = 0.5 * (free + blocked);
        (touches(middle) ? blocked : free) = middle;
      }
      jaws.stop_jaw(t, side, free);
      break;
    }
  }
}

void Grasping::update(double t, double h, const CellMotion& motion, CellPlant& plant,
                      ComponentInteraction& interaction, ContactInteraction& contacts) {
  for (std::size_t i = 0; i < plant.grippers().size(); ++i) {
    ParallelGripper& jaws = plant.grippers()[i];
    const GripperModel& model = model_.grippers[i];
    GraspState& state = states_[i];
    if (by_contact_[i] != 0) {
      const std::array<int, 2>& ids = model.parameters.jaws;
      const bool pressed = contacts.pressed(motion, ids[0]) && contacts.pressed(motion, ids[1]);
      if (pressed) held_until_s_[i] = -1.0;
      state.active = modes_[i] != Mode::open && (pressed || t < held_until_s_[i]);
      if (state.active)
        set_volume(state, model, plant.jaw_coordinate(i, ParallelGripper::left, t),
                   plant.jaw_coordinate(i, ParallelGripper::right, t));
      continue;
    }
    if (modes_[i] != Mode::open) stop_jaws(i, t, h, motion, jaws, interaction);
    const bool touched = jaws.blocked(ParallelGripper::left) && jaws.blocked(ParallelGripper::right);
    const bool on_command = modes_[i] == Mode::close && model.rule == GraspRule::on_command;
    state.active = on_command || (modes_[i] != Mode::open && touched);
    if (state.active)
      set_volume(state, model, jaws.coordinate(t, ParallelGripper::left),
                 jaws.coordinate(t, ParallelGripper::right));
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
