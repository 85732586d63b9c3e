// Outputs of a simulation: snapshots and explanations.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>

#include "server/simulation/step/simulation_impl.h"

namespace takt {

namespace {
void read_dynamics(const DynamicRobot::Output& output, RobotSample& sample) {
  sample.effort = output.torque;
  sample.flange_load_W = output.flange_load_W;
  sample.base_reaction_W = output.base_reaction_W;
  sample.power = output.power;
  sample.drives = output.drives;
}

std::uint64_t difference(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) ^ std::bit_cast<std::uint64_t>(b);
}
std::uint64_t difference(const Vec3& a, const Vec3& b) {
  return difference(a.x(), b.x()) | difference(a.y(), b.y()) | difference(a.z(), b.z());
}
std::uint64_t difference(const Quat& a, const Quat& b) {
  return difference(a.x(), b.x()) | difference(a.y(), b.y()) | difference(a.z(), b.z()) |
         difference(a.w(), b.w());
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

void Simulation::read_instant(Snapshot& snapshot) const {
  impl_->fill_instant(snapshot);
}

void Simulation::read_component(int component, ComponentSample& sample) const {
  impl_->guard([&] {
    impl_->refresh_motion();
    impl_->fill_component(component, sample);
  });
}

void Simulation::read_machines(Snapshot& snapshot) const {
  impl_->guard([&] {
    impl_->refresh_motion();
    for (std::size_t i = 0; i < snapshot.robots.size(); ++i) impl_->fill_robot(i, snapshot.robots[i]);
    for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) impl_->fill_gripper(i, snapshot.grippers[i]);
    impl_->fill_devices(snapshot);
  });
}

void Simulation::read_loads(Snapshot& snapshot) const {
  Impl& s = *impl_;
  s.guard([&] {
    s.refresh_motion();
    const std::span<const Wrench> wrenches = s.system().update_wrenches();
    s.fill_instant(snapshot);
    for (std::size_t i = 0; i < snapshot.components.size(); ++i) {
      ComponentSample& sample = snapshot.components[i];
      sample.partner = s.interaction.partner(static_cast<int>(i));
      if (sample.partner >= 0) sample.F_Bo_W = s.wrench_on(static_cast<int>(i), wrenches);
    }
    for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
      s.fill_robot(i, snapshot.robots[i]);
      s.fill_robot_loads(i, wrenches, snapshot.robots[i]);
    }
    s.fill_devices(snapshot);
    s.fill_contacts(snapshot.contacts);
  });
}

void Simulation::Impl::fill(Snapshot& snapshot) {
  refresh_motion();
  const std::span<const Wrench> wrenches = system().update_wrenches();
  fill_instant(snapshot);
  for (std::size_t i = 0; i < snapshot.components.size(); ++i)
    renew_component(static_cast<int>(i), wrenches[i], snapshot.components[i]);
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    fill_robot(i, snapshot.robots[i]);
    fill_robot_loads(i, wrenches, snapshot.robots[i]);
  }
  for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) {
    GripperSample& sample = snapshot.grippers[i];
    fill_gripper(i, sample);
    const auto robot = static_cast<std::size_t>(model->description.grippers[i].robot);
    signals.add_drive_force(i, snapshot.robots[robot].effort, sample);
  }
  fill_devices(snapshot);
  fill_contacts(snapshot.contacts);
}

void Simulation::Impl::fill_instant(Snapshot& snapshot) const {
  snapshot.step = step_index;
  snapshot.epoch = epoch;
  snapshot.time_s = time();
  snapshot.state_hash = hash.value();
}

const Quat& Simulation::Impl::quaternion_of(int component) {
  const BodyMotion& body = system().motion().bodies[static_cast<std::size_t>(component)];
  Orientation& orientation = orientations[static_cast<std::size_t>(component)];
  if (std::memcmp(orientation.R_WB.data(), body.X_WB.R.data(), sizeof(Mat3)) != 0)
    orientation = {body.X_WB.R, body.X_WB.quaternion()};
  return orientation.q_WB;
}

PartState Simulation::Impl::part_state_of(int component, int partner) const {
  return is_parked(component) ? PartState::parked
                              : part_state(model->components, interaction.graph(), component, partner);
}

void Simulation::Impl::fill_component(int component, ComponentSample& sample) {
  const BodyMotion& body = system().motion().bodies[static_cast<std::size_t>(component)];
  sample.p_WB = body.X_WB.p;
  sample.q_WB = quaternion_of(component);
  sample.V_WB = body.V_WB;
  sample.partner = interaction.partner(component);
  sample.state = part_state_of(component, sample.partner);
}

Wrench Simulation::Impl::wrench_on(int component, std::span<const Wrench> wrenches) {
  const BodyMotion& body = system().motion().bodies[static_cast<std::size_t>(component)];
  const Wrench& wrench = wrenches[static_cast<std::size_t>(component)];
  return {wrench.f, wrench.t + (body.p_WBcm - body.X_WB.p).cross(wrench.f)};
}

/// Another thread reads snapshots on another processor: memory that is written has to come back from there, and to go there
/// again, which takes several times as long as to compare it. Most Parts rest.
void Simulation::Impl::renew_component(int component, const Wrench& wrench, ComponentSample& sample) {
  const BodyMotion& body = system().motion().bodies[static_cast<std::size_t>(component)];
  const Quat& q_WB = quaternion_of(component);
  const int partner = interaction.partner(component);
  const PartState state = part_state_of(component, partner);
  // wrench_on(), number by number: the processor waits where numbers that were just written are read in pairs.
  const double x = body.p_WBcm.x() - body.X_WB.p.x(), y = body.p_WBcm.y() - body.X_WB.p.y(),
               z = body.p_WBcm.z() - body.X_WB.p.z();
  const Vec3& f = wrench.f;
  const double t_x = wrench.t.x() + (y * f.z() - z * f.y()), t_y = wrench.t.y() + (z * f.x() - x * f.z()),
               t_z = wrench.t.z() + (x * f.y() - y * f.x());
  const Vec3& kept_t = sample.F_Bo_W.t;
  const std::uint64_t different = difference(body.X_WB.p, sample.p_WB) | difference(q_WB, sample.q_WB) |
                                  difference(body.V_WB.v, sample.V_WB.v) |
                                  difference(body.V_WB.w, sample.V_WB.w) | difference(f, sample.F_Bo_W.f) |
                                  difference(t_x, kept_t.x()) | difference(t_y, kept_t.y()) |
                                  difference(t_z, kept_t.z());
  if (different == 0 && partner == sample.partner && state == sample.state) return;
  sample.p_WB = body.X_WB.p;
  sample.q_WB = q_WB;
  sample.V_WB = body.V_WB;
  sample.F_Bo_W = {f, Vec3(t_x, t_y, t_z)};
  sample.state = state;
  sample.partner = partner;
}

void Simulation::Impl::fill_robot(std::size_t robot, RobotSample& sample) {
  const auto& arm = system().motion().arms[robot];
  sample.position = arm.q;
  sample.velocity = arm.qd;
  sample.commands_applied = robot_commands[robot].count;
  sample.newest_stamp = robot_commands[robot].newest_stamp;
  sample.level_of_detail = plant.level(robot);
}

void Simulation::Impl::fill_robot_loads(std::size_t robot, std::span<const Wrench> wrenches,
                                        RobotSample& sample) {
  // A snapshot is reused: at LoD 1 it must not keep values of an earlier LoD 2.
  const DynamicRobot* dynamic = plant.dynamic(robot);
  read_dynamics(dynamic != nullptr ? plant.robot_output(robot, time(), system().motion(), wrenches)
                                   : DynamicRobot::Output{},
                sample);
}

void Simulation::Impl::fill_gripper(std::size_t gripper, GripperSample& sample) {
  signals.read_gripper(gripper, time(), sample);
  sample.commands_applied = gripper_commands[gripper].count;
  sample.newest_stamp = gripper_commands[gripper].newest_stamp;
}

void Simulation::Impl::fill_devices(Snapshot& snapshot) {
  for (std::size_t i = 0; i < snapshot.devices.size(); ++i) {
    DeviceSample& sample = snapshot.devices[i];
    plant.read_signals(i, time(),
                       std::span(sample.signals).first(model->description.devices[i].signals.size()));
    sample.forced = 0;
    for (const ForcedSignal& forced : plant.forced_signals())
      if (forced.ref.device == static_cast<int>(i))
        sample.forced |= 1U << static_cast<unsigned>(forced.ref.signal);
    sample.commands_applied = device_commands[i].count;
    sample.newest_stamp = device_commands[i].newest_stamp;
  }
}

void Simulation::Impl::fill_contacts(ContactsSample& sample) {
  sample.acting = std::find(process_levels.begin(), process_levels.end(), 3) != process_levels.end();
  const std::size_t pressing = contacts.read(system().motion(), std::span<ContactSample>(sample.samples));
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
  if (s.is_parked(component)) e.state = PartState::parked;
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
