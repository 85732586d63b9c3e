// Outputs of a simulation: snapshots and explanations.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "server/simulation/step/simulation_impl.h"

namespace takt {

namespace {
constexpr double kJawStands_m_per_s = 1e-3;
constexpr double kInPosition_m = 1e-4;

void read_dynamics(const DynamicRobot::Output& output, RobotSample& sample) {
  sample.effort = output.torque;
  sample.flange_load_W = output.flange_load_W;
  sample.base_reaction_W = output.base_reaction_W;
  sample.power = output.power;
  sample.drives = output.drives;
}
}  // namespace

std::size_t Simulation::contact_capacity() const {
  return impl_->model->contact.enabled ? std::min(impl_->contacts.pair_count(), kMaxContactSamples) : 0;
}

Snapshot Simulation::make_snapshot() const {
  Snapshot snapshot;
  snapshot.components.resize(impl_->model->components.size());
  snapshot.robots.resize(impl_->model->robots.size());
  snapshot.grippers.resize(impl_->model->grippers.size());
  snapshot.devices.resize(impl_->model->description.devices.size());
  snapshot.contacts.samples.resize(contact_capacity());
  read_snapshot(snapshot);
  return snapshot;
}

void Simulation::read_snapshot(Snapshot& snapshot) const {
  impl_->guard([&] { impl_->fill(snapshot); });
}

void Simulation::Impl::fill(Snapshot& snapshot) {
  const double t = time();
  refresh_motion();
  const std::span<const Wrench> wrenches = system().update_wrenches();
  const CellMotion& motion = system().motion();
  snapshot.step = step_index;
  snapshot.epoch = epoch;
  snapshot.time_s = t;
  snapshot.state_hash = hash.value();
  for (std::size_t i = 0; i < snapshot.components.size(); ++i) {
    ComponentSample& sample = snapshot.components[i];
    const BodyMotion& body = motion.bodies[i];
    sample.p_WB = body.X_WB.p;
    sample.q_WB = body.X_WB.quaternion();
    sample.V_WB = body.V_WB;
    sample.F_Bo_W = {wrenches[i].f, wrenches[i].t + (body.p_WBcm - body.X_WB.p).cross(wrenches[i].f)};
    sample.partner = interaction.partner(static_cast<int>(i));
    sample.state = part_state(model->components, interaction.graph(), static_cast<int>(i), sample.partner);
  }
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    RobotSample& sample = snapshot.robots[i];
    sample.position = motion.arms[i].q;
    sample.velocity = motion.arms[i].qd;
    sample.commands_applied = robot_commands[i].count;
    sample.newest_stamp = robot_commands[i].newest_stamp;
    sample.level_of_detail = plant.level(i);
    // A snapshot is reused: at LoD 1 it must not keep values of an earlier LoD 2.
    const DynamicRobot* robot = plant.dynamic(i);
    read_dynamics(robot != nullptr ? robot->output(t, plant.segment(i).data(), motion, wrenches)
                                   : DynamicRobot::Output{},
                  sample);
  }
  for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) {
    GripperSample& sample = snapshot.grippers[i];
    sample.width_m = std::max(0.0, plant.width(i, t));
    sample.moving = false;
    for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
      sample.moving = sample.moving || std::abs(plant.jaw_speed(i, side, t)) > kJawStands_m_per_s;
    sample.in_position =
        !sample.moving && std::abs(sample.width_m - grasping.commanded_width_m(i)) <= kInPosition_m;
    sample.part = grasping.part_present(i);
    sample.force_N = 0.0;
    const auto robot = static_cast<std::size_t>(model->description.grippers[i].robot);
    if (sample.part >= 0 && !grasping.by_contact(i)) {
      sample.force_N = grasping.grip_force_N(i, plant);
    } else if (plant.dynamic(robot) != nullptr) {
      for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
        sample.force_N += 0.5 * std::abs(snapshot.robots[robot].effort[plant.jaw_joint(i, side)]);
    }
    sample.closed = grasping.closed(i);
    sample.commands_applied = gripper_commands[i].count;
    sample.newest_stamp = gripper_commands[i].newest_stamp;
  }
  for (std::size_t i = 0; i < snapshot.devices.size(); ++i) {
    DeviceSample& sample = snapshot.devices[i];
    plant.read_signals(i, t, std::span(sample.signals).first(model->description.devices[i].signals.size()));
    sample.commands_applied = device_commands[i].count;
    sample.newest_stamp = device_commands[i].newest_stamp;
  }
  ContactsSample& sample = snapshot.contacts;
  sample.acting = std::find(process_levels.begin(), process_levels.end(), 3) != process_levels.end();
  const std::size_t pressing = contacts.read(motion, std::span<ContactSample>(sample.samples));
  sample.count = std::min(pressing, sample.samples.size());
  sample.omitted = pressing - sample.count;
}

void Simulation::Impl::measure_by_contact(std::span<const ContactSample> samples,
                                          ExplainedContact& contact) const {
  const auto of_both = [&contact](const auto& pair) {
    return std::minmax(pair.base, pair.target) == std::minmax(contact.a, contact.b);
  };
  if (!contacts.acting(contact.a, contact.b)) return;
  contact.depth = {};
  contact.by_surface = true;
  const auto sample = std::find_if(samples.begin(), samples.end(), of_both);
  if (sample == samples.end()) return;
  contact.depth.known = true;
  contact.depth.distance_m = -sample->result.largest_penetration_m;
  contact.depth.position_W = sample->p_WC;
  const double force_N = sample->F_base_W.f.norm();
  if (force_N > 0.0)
    contact.depth.normal_W = (sample->base == contact.a ? -1.0 : 1.0) / force_N * sample->F_base_W.f;
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
  e.surface_contact = s.contacts.acts_on(component);
  std::vector<ContactSample> samples;
  s.contacts.read(s.system().motion(), samples);
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(e.pressing), of_component);
  for (ExplainedContact& contact : e.contacts) s.measure_by_contact(samples, contact);
  return e;
}

}  // namespace takt
