#include "server/headless/mcap_recording.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "server/scenario/contact_pair_names.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

using recording::CdrWriter;

namespace {

constexpr double kFrames_s = 0.02, kStatus_s = 0.1;

void put(CdrWriter& out, const Vec3& v) {
  out.put(v.x());
  out.put(v.y());
  out.put(v.z());
}

void put(CdrWriter& out, const Quat& q) {
  out.put(q.x());
  out.put(q.y());
  out.put(q.z());
  out.put(q.w());
}

void put_rows(CdrWriter& out, const Mat3& R) {
  out.count(9);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) out.put(R(row, column));
}

void put(CdrWriter& out, const Pose& X) {
  put(out, X.p);
  put_rows(out, X.R);
}

void put_time(CdrWriter& out, std::uint64_t ns) {
  out.put(static_cast<std::int32_t>(ns / 1'000'000'000U));
  out.put(static_cast<std::uint32_t>(ns % 1'000'000'000U));
}

std::uint64_t nanoseconds(double time_s) {
  return static_cast<std::uint64_t>(std::llround(std::max(time_s, 0.0) * 1e9));
}

template <typename Array>
void put_first(CdrWriter& out, const Array& values, std::size_t count) {
  out.count(count);
  for (std::size_t i = 0; i < count; ++i) out.put(values[i]);
}

void put(CdrWriter& out, const ComponentDescription& component) {
  out.put(component.name);
  out.put(static_cast<std::uint8_t>(component.type));
  out.put(static_cast<std::int32_t>(component.hierarchy));
  out.put(component.mass_kg);
  put(out, component.p_BBcm);
  out.put(component.mesh_uri);
  out.sequence(component.vertices);
  out.sequence(component.triangles);
  out.sequence(component.color);
}

void put(CdrWriter& out, const RobotDescription& robot) {
  out.put(robot.name);
  out.put(robot.urdf);
  out.count(robot.arm.joints.size());
  for (const JointModel& joint : robot.arm.joints) {
    out.put(joint.name);
    out.put(std::uint8_t{joint.type == JointType::prismatic ? std::uint8_t{1} : std::uint8_t{0}});
    put(out, joint.X_PJ);
    put(out, joint.axis);
    for (const double value : {joint.lower, joint.upper, joint.max_velocity, joint.max_effort})
      out.put(value);
  }
  put(out, robot.arm.X_JF);
  put(out, robot.X_WR);
  out.put(robot.command_period_s);
  out.put(robot.command_deadline.deadline_s);
  out.put(static_cast<std::uint8_t>(robot.command_deadline.action));
}

void put(CdrWriter& out, const GripperDescription& gripper) {
  out.put(gripper.name);
  for (const int index : {gripper.robot, gripper.component, gripper.left_jaw, gripper.right_jaw})
    out.put(static_cast<std::int32_t>(index));
  put(out, gripper.X_FG);
  put(out, gripper.X_GT);
  for (const double value : {gripper.max_width_m, gripper.max_force_N, gripper.jaw_speed_m_per_s})
    out.put(value);
}

void put(CdrWriter& out, const DeviceDescription& device) {
  out.put(device.name);
  out.count(device.signals.size());
  for (const SignalDescription& signal : device.signals) out.put(signal.name);
  out.count(device.signals.size());
  for (const SignalDescription& signal : device.signals) {
    out.put(signal.unit);
    out.put(static_cast<std::uint8_t>(signal.commanded));
    out.put(signal.lower);
    out.put(signal.upper);
  }
}

void put_applied(CdrWriter& out, const std::string& target, std::uint64_t count, SimTime newest_stamp) {
  out.put(target);
  out.put(count);
  put_time(out, static_cast<std::uint64_t>(std::max<std::int64_t>(newest_stamp.ns, 0)));
}

}  // namespace

McapRecording::McapRecording(const std::filesystem::path& file, const Simulation& simulation,
                             McapRecordingOptions options)
    : writer_(file, options.version, options.compression),
      prefix_("/" + (simulation.description().cell.empty() ? "cell" : simulation.description().cell) + "/"),
      options_(std::move(options)),
      frames_(simulation.description()),
      elements_(simulation.model().contact),
      began_(std::chrono::steady_clock::now()) {
  const CellDescription& cell = simulation.description();
  std::vector<std::string> unknown;
  pressure_pairs_ = find_contact_pairs(simulation.model().contact, cell, options_.pressures, &unknown);
  if (!unknown.empty())
    throw std::invalid_argument(
        "no pair in surface contact is called '" + unknown.front() +
        "'; names are BASE-TARGET as takt contacts lists them, * stands for any characters");
  write_description(cell, options_.version);
  state_channel_ = add_channel("state", "takt_msgs/msg/CellState");
  event_channel_ = add_channel("events", "takt_msgs/msg/Event");
  status_channel_ = add_channel("status", "takt_msgs/msg/Status");
  tf_channel_ = add_channel("/tf", "tf2_msgs/msg/TFMessage");
  tf_static_channel_ = add_channel("/tf_static", "tf2_msgs/msg/TFMessage");
  if (!pressure_pairs_.empty())
    pressures_channel_ = add_channel("contact_pressures", "takt_msgs/msg/ContactPressures");
  for (const RobotDescription& robot : cell.robots)
    joint_channels_.push_back(add_channel(robot.name + "/joint_states", "sensor_msgs/msg/JointState"));
}

std::uint16_t McapRecording::add_channel(const std::string& name, const std::string& type) {
  const std::string topic = name.front() == '/' ? name : prefix_ + name;
  return writer_.add_channel(topic, recording::known_types(), type, recording::qos_of_server(topic));
}

void McapRecording::write(std::uint16_t channel) {
  writer_.write(channel, now_ns_, now_ns_, sample_.bytes());
}

void McapRecording::write_description(const CellDescription& cell, const std::string& version) {
  sample_.clear();
  sample_.put(prefix_.substr(1, prefix_.size() - 2));
  sample_.put(cell.scenario);
  sample_.put(cell.scenario_generation);
  sample_.put(version);
  sample_.put(cell.step_s);
  sample_.put(static_cast<std::int32_t>(cell.level_of_detail));
  put(sample_, cell.gravity_m_per_s2);
  const auto list = [&](const auto& elements) {
    sample_.count(elements.size());
    for (const auto& element : elements) put(sample_, element);
  };
  list(cell.components);
  list(cell.robots);
  list(cell.grippers);
  list(cell.devices);
  write(add_channel("description", "takt_msgs/msg/CellDescription"));
}

void McapRecording::record(const Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  const auto due = [&](std::uint64_t& next, double period_s) {
    if (simulation.step_index() < period_boundary_step(next, period_s, cell.step_s)) return false;
    while (simulation.step_index() >= period_boundary_step(next, period_s, cell.step_s)) ++next;
    return true;
  };
  if (!due(next_, options_.period_s)) return;
  const bool first = now_ns_ == 0 && next_frames_ == 0;
  snapshot_ = simulation.make_snapshot();
  now_ns_ = nanoseconds(snapshot_.time_s);
  if (first) write_frames(tf_static_channel_, static_frames(cell, snapshot_));
  write_state(cell);
  for (std::size_t robot = 0; robot < cell.robots.size(); ++robot) write_joints(cell, robot);
  write_power(cell);
  write_contacts(cell);
  if (!pressure_pairs_.empty()) write_pressures(cell);
  if (due(next_frames_, kFrames_s)) write_frames(tf_channel_, frames_.fill(snapshot_));
  if (due(next_status_, kStatus_s)) write_status(simulation);
}

void McapRecording::begin_sample(const CellDescription* of_world) {
  sample_.clear();
  put_time(sample_, now_ns_);
  sample_.put(snapshot_.time_s);
  sample_.put(snapshot_.step);
  sample_.put(snapshot_.epoch);
  if (of_world != nullptr) sample_.put(of_world->scenario_generation);
}

void McapRecording::write_frames(std::uint16_t channel, const std::vector<CellFrame>& frames) {
  sample_.clear();
  sample_.count(frames.size());
  for (const CellFrame& frame : frames) {
    put_time(sample_, now_ns_);
    sample_.put(frame.parent);
    sample_.put(frame.name);
    put(sample_, frame.p);
    put(sample_, frame.q);
  }
  write(channel);
}

/// Of a run that nobody waits for: there is no lag, no overrun, no latency.
void McapRecording::write_status(const Simulation& simulation) {
  constexpr std::uint8_t kPlaying = 1;
  const CellDescription& cell = simulation.description();
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  begin_sample(&cell);
  sample_.put(kPlaying);
  sample_.put(options_.pace);
  sample_.put(options_.factor);
  sample_.put(wall_s);
  sample_.put(wall_s > 0.0 ? snapshot_.time_s / wall_s : 0.0);
  sample_.put(snapshot_.time_s > 0.0 ? wall_s / snapshot_.time_s : 0.0);
  sample_.put(0.0);  // lag
  for (int count = 0; count < 3; ++count)
    sample_.put(std::uint64_t{0});                                    // overruns, their runs, schedule_resets
  for (int quantile = 0; quantile < 9; ++quantile) sample_.put(0.0);  // of steps, wake-ups, latencies
  std::uint64_t applied = 0;
  const auto add = [&](const auto& samples) {
    for (const auto& target : samples) applied += target.commands_applied;
  };
  add(snapshot_.robots);
  add(snapshot_.grippers);
  add(snapshot_.devices);
  sample_.put(applied);
  sample_.put(std::uint64_t{0});  // commands rejected: they end a run
  const SimulationStatistics& statistics = simulation.statistics();
  sample_.put(statistics.mpr_calls);
  sample_.put(statistics.mpr_skipped);
  sample_.put(simulation.solver().name);
  sample_.put(statistics.solver.steps);
  sample_.put(statistics.solver.rejected_steps);
  sample_.count(cell.processes.size());
  for (std::size_t i = 0; i < cell.processes.size(); ++i) {
    sample_.put(cell.processes[i].name);
    sample_.put(static_cast<std::int32_t>(simulation.process_level(i)));
  }
  sample_.count(0);  // waiting for nobody
  sample_.put("");   // no scheduling was asked for
  sample_.put(simulation.fault());
  const ContactsSample& contacts = snapshot_.contacts;
  sample_.put(static_cast<std::uint32_t>(contacts.pressing().size() + contacts.omitted));
  const ContactCallCounts& calls = simulation.contact_counts();
  sample_.put(calls.made);
  sample_.put(calls.skipped);
  sample_.put(calls.elements);
  sample_.put(calls.rebuilds);
  write(status_channel_);
}

void McapRecording::write_pressures(const CellDescription& cell) {
  const std::vector<PressedPair>& pressed = elements_.read(snapshot_, pressure_pairs_);
  begin_sample(&cell);
  sample_.count(pressed.size());
  for (const PressedPair& pair : pressed) {
    sample_.put(static_cast<std::int32_t>(pair.base));
    sample_.put(static_cast<std::int32_t>(pair.target));
    sample_.put(pair.largest_pressure_Pa);
    sample_.count(9 * pair.elements.size());
    for (const PressedElement& element : pair.elements)
      for (const Vec3& corner : element.corner_B)
        for (const double value : corner) sample_.put(static_cast<float>(value));
    sample_.count(pair.elements.size());
    for (const PressedElement& element : pair.elements) sample_.put(static_cast<float>(element.pressure_Pa));
    sample_.put(static_cast<std::uint32_t>(pair.omitted));
  }
  write(pressures_channel_);
}

void McapRecording::record(const Simulation& simulation, const RecordedEvent& event) {
  now_ns_ = nanoseconds(event.time_s);
  sample_.clear();
  sample_.put(++events_);
  put_time(sample_, now_ns_);
  sample_.put(event.step);
  sample_.put(simulation.epoch());
  sample_.put(event.severity);
  sample_.put(event.code);
  sample_.put(event.subject);
  sample_.put("");
  sample_.put(event.message);
  write(event_channel_);
}

void McapRecording::write_state(const CellDescription& cell) {
  const Snapshot& s = snapshot_;
  begin_sample(&cell);
  sample_.put(s.state_hash);
  sample_.count(s.components.size());
  for (const ComponentSample& c : s.components) {
    put(sample_, c.p_WB);
    put(sample_, c.q_WB);
    put(sample_, c.V_WB.v);
    put(sample_, c.V_WB.w);
    put(sample_, c.F_Bo_W.f);
    put(sample_, c.F_Bo_W.t);
    sample_.put(static_cast<std::uint8_t>(c.state));
    sample_.put(static_cast<std::int32_t>(c.partner));
  }
  sample_.count(s.robots.size());
  for (std::size_t i = 0; i < s.robots.size(); ++i) {
    const RobotSample& robot = s.robots[i];
    const std::size_t joints = cell.robots[i].arm.joints.size();
    put_first(sample_, robot.position, joints);
    put_first(sample_, robot.velocity, joints);
    put_first(sample_, robot.effort, joints);
    put_first(sample_, robot.power.mechanical_W, robot.level_of_detail > 1 ? joints : 0);
  }
  sample_.count(s.grippers.size());
  for (const GripperSample& gripper : s.grippers) {
    sample_.put(gripper.width_m);
    sample_.put(gripper.force_N);
    for (const bool flag : {gripper.closed, gripper.moving, gripper.in_position})
      sample_.put(static_cast<std::uint8_t>(flag ? 1 : 0));
    sample_.put(static_cast<std::int32_t>(gripper.part));
  }
  sample_.count(s.devices.size());
  for (std::size_t i = 0; i < s.devices.size(); ++i)
    put_first(sample_, s.devices[i].signals, cell.devices[i].signals.size());
  sample_.count(s.robots.size() + s.grippers.size() + s.devices.size());
  const auto applied = [&](const auto& described, const auto& samples) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      put_applied(sample_, described[i].name, samples[i].commands_applied, samples[i].newest_stamp);
  };
  applied(cell.robots, s.robots);
  applied(cell.grippers, s.grippers);
  applied(cell.devices, s.devices);
  write(state_channel_);
}

void McapRecording::write_joints(const CellDescription& cell, std::size_t robot) {
  const RobotDescription& description = cell.robots[robot];
  const auto& joints = description.arm.joints;
  const RobotSample& state = snapshot_.robots[robot];
  sample_.clear();
  put_time(sample_, now_ns_);
  sample_.put(base_frame(description));
  sample_.count(joints.size());
  for (const JointModel& joint : joints) sample_.put(joint.name);
  put_first(sample_, state.position, joints.size());
  put_first(sample_, state.velocity, joints.size());
  put_first(sample_, state.effort, joints.size());
  write(joint_channels_[robot]);
}

void McapRecording::write_power(const CellDescription& cell) {
  const auto dynamic = [](const RobotSample& robot) { return robot.level_of_detail > 1; };
  const auto metered = [](const DeviceDescription& device) { return device.meter().has_value(); };
  const auto count = std::count_if(snapshot_.robots.begin(), snapshot_.robots.end(), dynamic) +
                     std::count_if(cell.devices.begin(), cell.devices.end(), metered);
  if (count == 0 && power_channel_ == 0) return;
  if (power_channel_ == 0) power_channel_ = add_channel("power", "takt_msgs/msg/Power");
  begin_sample(nullptr);
  sample_.count(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < snapshot_.robots.size(); ++i) {
    if (!dynamic(snapshot_.robots[i])) continue;
    const RobotPower& power = snapshot_.robots[i].power;
    std::size_t drives = cell.robots[i].arm.joints.size();
    for (const GripperDescription& gripper : cell.grippers)
      if (gripper.robot == static_cast<int>(i)) drives += 2;
    sample_.put(cell.robots[i].name);
    put_first(sample_, power.mechanical_W, drives);
    for (const double value :
         {power.mechanical_total_W, power.electrical_W, power.mechanical_energy_J, power.electrical_energy_J})
      sample_.put(value);
  }
  for (std::size_t i = 0; i < cell.devices.size(); ++i) {
    const auto meter = cell.devices[i].meter();
    if (!meter) continue;
    const auto& signals = snapshot_.devices[i].signals;
    sample_.put(cell.devices[i].name);
    sample_.count(0);  // drives
    for (const double value : {0.0, signals[meter->power], 0.0, signals[meter->energy]}) sample_.put(value);
  }
  write(power_channel_);
}

void McapRecording::write_contacts(const CellDescription& cell) {
  const ContactsSample& contacts = snapshot_.contacts;
  if (!contacts.acting && contacts_channel_ == 0) return;
  if (contacts_channel_ == 0) contacts_channel_ = add_channel("contacts", "takt_msgs/msg/Contacts");
  begin_sample(&cell);
  sample_.count(contacts.count);
  for (const ContactSample& contact : contacts.pressing()) {
    sample_.put(static_cast<std::int32_t>(contact.base));
    sample_.put(static_cast<std::int32_t>(contact.target));
    put(sample_, contact.F_base_W.f);
    put(sample_, contact.F_base_W.t);
    put(sample_, contact.p_WC);
    sample_.put(static_cast<std::uint32_t>(contact.result.elements));
    for (const double value :
         {contact.result.area_m2, contact.result.normal_force_N, contact.result.friction_force_N,
          contact.result.largest_pressure_Pa, contact.result.largest_penetration_m})
      sample_.put(value);
  }
  sample_.put(static_cast<std::uint64_t>(contacts.omitted));
  write(contacts_channel_);
}

}  // namespace takt
