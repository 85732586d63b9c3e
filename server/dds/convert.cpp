#include "server/dds/convert.h"

#include <cmath>

#include "idl/common/utf8.h"
#include "server/dds/participant.h"
#include "server/dds/tf_frames.h"
#include "server/runtime/loop/command_buffer.h"

namespace takt {
namespace {

takt_msgs::msg::Vector3 to_vector(const Vec3& v) {
  takt_msgs::msg::Vector3 message;
  message.x(v.x());
  message.y(v.y());
  message.z(v.z());
  return message;
}

void fill(takt_msgs::msg::Vector3& message, const Vec3& v) {
  message.x(v.x());
  message.y(v.y());
  message.z(v.z());
}

std::vector<double> row_major(const Mat3& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}

takt_msgs::msg::Transform to_transform(const Pose& X) {
  takt_msgs::msg::Transform message;
  message.position(to_vector(X.p));
  message.rotation(row_major(X.R));
  return message;
}

template <std::size_t Capacity>
std::string checked_length(const std::string& text, const char* what) {
  if (text.size() <= Capacity) return text;
  throw DdsError(std::string(what) + " '" + utf8_sanitize(text, 60) + "...' has " +
                 std::to_string(text.size()) + " characters; over DDS at most " + std::to_string(Capacity) +
                 " are allowed.");
}
/// The text as it is, or an error: a name cut off or with another character would be another name.
template <std::size_t Capacity>
std::string fitting(const std::string& text, const char* what) {
  if (!validate_utf8(text))
    throw DdsError(std::string(what) + " '" + utf8_sanitize(text, 60) +
                   "' is no text; over DDS it must be UTF-8 without control characters.");
  return checked_length<Capacity>(text, what);
}

takt_msgs::msg::ComponentDescription to_message(const ComponentDescription& component) {
  if (component.triangles.size() / 3 > kMaxTriangles) {
    throw DdsError("The mesh of '" + component.name + "' has " +
                   std::to_string(component.triangles.size() / 3) + " triangles; over DDS at most " +
                   std::to_string(kMaxTriangles) + " are allowed.");
  }
  takt_msgs::msg::ComponentDescription message;
  message.name(fitting<128>(component.name, "The component's name"));
  message.type(static_cast<std::uint8_t>(component.type));
  message.hierarchy(component.hierarchy);
  message.mass(component.mass_kg);
  message.center_of_mass(to_vector(component.p_BBcm));
  message.mesh_uri(fitting<1024>(utf8_sanitize(component.mesh_uri), "The mesh file"));
  message.vertices(component.vertices);
  message.triangles(component.triangles);
  message.color({component.color.begin(), component.color.end()});
  return message;
}

/// Sequences of our types are bounded (idl/takt_msgs.idl): readers refuse longer ones whole.
void require_room(std::size_t count, std::size_t most, const std::string& what) {
  if (count > most)
    throw DdsError("The cell has " + std::to_string(count) + " " + what + "; its messages have room for " +
                   std::to_string(most) + ".");
}

takt_msgs::msg::RobotDescription to_message(const RobotDescription& robot) {
  takt_msgs::msg::RobotDescription message;
  message.name(fitting<128>(robot.name, "The robot's name"));
  message.urdf(
      checked_length<262144>(utf8_sanitize(robot.urdf, robot.urdf.size(), LineBreaks::allow), "The URDF"));
  for (const JointModel& joint : robot.arm.joints) {
    takt_msgs::msg::JointDescription described;
    described.name(fitting<128>(joint.name, "The joint's name"));
    described.type(joint.type == JointType::prismatic ? 1 : 0);
    described.position(to_vector(joint.X_PJ.p));
    described.rotation(row_major(joint.X_PJ.R));
    described.axis(to_vector(joint.axis));
    described.lower(joint.lower);
    described.upper(joint.upper);
    described.max_velocity(joint.max_velocity);
    described.max_effort(joint.max_effort);
    message.joints().push_back(described);
  }
  message.flange(to_transform(robot.arm.X_JF));
  message.base(to_transform(robot.X_WR));
  message.command_period(robot.command_period_s);
  message.command_deadline(robot.command_deadline.deadline_s);
  message.safe_action(static_cast<std::uint8_t>(robot.command_deadline.action));
  return message;
}

takt_msgs::msg::GripperDescription to_message(const GripperDescription& gripper) {
  takt_msgs::msg::GripperDescription message;
  message.name(fitting<128>(gripper.name, "The gripper's name"));
  message.robot(gripper.robot);
  message.palm(gripper.component);
  message.left_jaw(gripper.left_jaw);
  message.right_jaw(gripper.right_jaw);
  message.mount(to_transform(gripper.X_FG));
  message.tool_center_point(to_transform(gripper.X_GT));
  message.max_width(gripper.max_width_m);
  message.max_force(gripper.max_force_N);
  message.jaw_speed(gripper.jaw_speed_m_per_s);
  return message;
}

takt_msgs::msg::DeviceDescription to_message(const DeviceDescription& device) {
  takt_msgs::msg::DeviceDescription message;
  message.name(fitting<128>(device.name, "The device's name"));
  for (const SignalDescription& signal : device.signals) {
    message.signals().emplace_back(fitting<128>(signal.name, "The signal's name"));
    auto& properties = message.properties().emplace_back();
    properties.unit(fitting<32>(signal.unit, "The signal's unit"));
    properties.commanded(signal.commanded);
    properties.lower(signal.lower);
    properties.upper(signal.upper);
  }
  return message;
}

}  // namespace

builtin_interfaces::msg::Time to_time(double time_s) {
  builtin_interfaces::msg::Time time;
  const std::int64_t ns = stamp_ns(std::max(time_s, 0.0));
  time.sec(static_cast<std::int32_t>(ns / 1'000'000'000));
  time.nanosec(static_cast<std::uint32_t>(ns % 1'000'000'000));
  return time;
}

takt_msgs::msg::CellDescription to_message(const CellDescription& cell, const std::string& server_version) {
  takt_msgs::msg::CellDescription message;
  message.cell(fitting<128>(cell.cell, "The cell's name"));
  message.scenario(fitting<128>(cell.scenario, "The scenario's name"));
  message.scenario_generation(cell.scenario_generation);
  message.server_version(fitting<64>(server_version, "The version"));
  message.step_size(cell.step_s);
  message.level_of_detail(cell.level_of_detail);
  message.gravity(to_vector(cell.gravity_m_per_s2));
  require_room(cell.components.size(), 4096, "components");
  require_room(cell.robots.size(), 64, "robots");
  require_room(cell.grippers.size(), 64, "grippers");
  require_room(cell.devices.size(), 64, "devices (furnaces, screwdrivers, heated and threaded Parts)");
  require_room(cell.processes.size(), 64, "processes");
  for (const auto& component : cell.components) message.components().push_back(to_message(component));
  for (const auto& robot : cell.robots) message.robots().push_back(to_message(robot));
  for (const auto& gripper : cell.grippers) message.grippers().push_back(to_message(gripper));
  for (const auto& device : cell.devices) message.devices().push_back(to_message(device));
  return message;
}

takt_msgs::msg::CellState make_state_message(const CellDescription& cell) {
  takt_msgs::msg::CellState message;
  message.scenario_generation(cell.scenario_generation);
  message.components().resize(cell.components.size());
  message.robots().resize(cell.robots.size());
  message.grippers().resize(cell.grippers.size());
  message.devices().resize(cell.devices.size());
  for (std::size_t i = 0; i < cell.devices.size(); ++i)
    message.devices()[i].signals().resize(cell.devices[i].signals.size());
  message.applied().resize(static_cast<std::size_t>(target_count(cell)));
  for (std::size_t i = 0; i < cell.robots.size(); ++i) {
    const auto joints = static_cast<std::size_t>(cell.robots[i].arm.joint_count());
    message.robots()[i].position().resize(joints);
    message.robots()[i].velocity().resize(joints);
    message.robots()[i].effort().resize(joints);
    message.robots()[i].motor_power().reserve(joints);
  }
  for (std::size_t i = 0; i < message.applied().size(); ++i) {
    message.applied()[i].target(std::string(target_name(cell, static_cast<int>(i))));
  }
  return message;
}

namespace {
void fill_devices(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot) {
  for (std::size_t i = 0; i < snapshot.devices.size(); ++i) {
    const DeviceSample& sample = snapshot.devices[i];
    auto& signals = message.devices()[i].signals();
    std::copy_n(sample.signals.begin(), signals.size(), signals.begin());
    auto& applied = message.applied()[cell.robots.size() + cell.grippers.size() + i];
    applied.count(sample.commands_applied);
    applied.newest_stamp(to_time(sample.newest_stamp_s));
  }
}
}  // namespace

void fill(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot) {
  message.stamp(to_time(snapshot.time_s));
  message.time(snapshot.time_s);
  message.step(snapshot.step);
  message.epoch(snapshot.epoch);
  message.state_hash(snapshot.state_hash);
  for (std::size_t i = 0; i < snapshot.components.size(); ++i) {
    const ComponentSample& sample = snapshot.components[i];
    auto& component = message.components()[i];
    fill(component.position(), sample.p_WB);
    component.orientation().x(sample.q_WB.x());
    component.orientation().y(sample.q_WB.y());
    component.orientation().z(sample.q_WB.z());
    component.orientation().w(sample.q_WB.w());
    fill(component.linear_velocity(), sample.V_WB.v);
    fill(component.angular_velocity(), sample.V_WB.w);
    fill(component.force(), sample.F_Bo_W.f);
    fill(component.torque(), sample.F_Bo_W.t);
    component.state(static_cast<std::uint8_t>(sample.state));
    component.partner(sample.partner);
  }
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    const RobotSample& sample = snapshot.robots[i];
    auto& robot = message.robots()[i];
    std::copy_n(sample.position.begin(), robot.position().size(), robot.position().begin());
    std::copy_n(sample.velocity.begin(), robot.velocity().size(), robot.velocity().begin());
    std::copy_n(sample.effort.begin(), robot.effort().size(), robot.effort().begin());
    robot.motor_power().resize(sample.level_of_detail > 1 ? robot.position().size() : 0);
    std::copy_n(sample.power.mechanical_W.begin(), robot.motor_power().size(), robot.motor_power().begin());
    message.applied()[i].count(sample.commands_applied);
    message.applied()[i].newest_stamp(to_time(sample.newest_stamp_s));
  }
  for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) {
    const GripperSample& sample = snapshot.grippers[i];
    auto& gripper = message.grippers()[i];
    gripper.width(sample.width_m);
    gripper.force(sample.force_N);
    gripper.closed(sample.closed);
    gripper.moving(sample.moving);
    gripper.in_position(sample.in_position);
    gripper.part(sample.part);
    auto& applied = message.applied()[cell.robots.size() + i];
    applied.count(sample.commands_applied);
    applied.newest_stamp(to_time(sample.newest_stamp_s));
  }
  fill_devices(message, cell, snapshot);
}

sensor_msgs::msg::JointState make_joint_states_message(const RobotDescription& robot) {
  sensor_msgs::msg::JointState message;
  message.header().frame_id(base_frame(robot));
  for (const auto& joint : robot.arm.joints) message.name().push_back(joint.name);
  message.position().resize(robot.arm.joints.size());
  message.velocity().resize(robot.arm.joints.size());
  message.effort().resize(robot.arm.joints.size());
  return message;
}

void fill(sensor_msgs::msg::JointState& message, const Snapshot& snapshot, std::size_t robot) {
  const RobotSample& sample = snapshot.robots[robot];
  message.header().stamp(to_time(snapshot.time_s));
  std::copy_n(sample.position.begin(), message.position().size(), message.position().begin());
  std::copy_n(sample.velocity.begin(), message.velocity().size(), message.velocity().begin());
  std::copy_n(sample.effort.begin(), message.effort().size(), message.effort().begin());
}

takt_msgs::msg::Power make_power_message(const CellDescription& cell) {
  takt_msgs::msg::Power message;
  message.consumers().reserve(cell.robots.size() + cell.devices.size());
  return message;
}

bool fill(takt_msgs::msg::Power& message, const CellDescription& cell, const Snapshot& snapshot) {
  message.stamp(to_time(snapshot.time_s));
  message.time(snapshot.time_s);
  message.step(snapshot.step);
  message.epoch(snapshot.epoch);
  std::size_t count = 0;
  for (const RobotSample& sample : snapshot.robots) count += sample.level_of_detail > 1 ? 1U : 0U;
  for (const DeviceDescription& device : cell.devices) count += device.meter() ? 1U : 0U;
  message.consumers().resize(count);
  std::size_t place = 0;
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    const RobotSample& sample = snapshot.robots[i];
    if (sample.level_of_detail <= 1) continue;
    takt_msgs::msg::PowerConsumer& consumer = message.consumers()[place++];
    consumer.name(cell.robots[i].name);
    std::size_t joints = cell.robots[i].arm.joints.size();
    for (const GripperDescription& gripper : cell.grippers)
      if (gripper.robot == static_cast<int>(i)) joints += 2;
    consumer.mechanical_power().resize(joints);
    std::copy_n(sample.power.mechanical_W.begin(), joints, consumer.mechanical_power().begin());
    consumer.mechanical_total(sample.power.mechanical_total_W);
    consumer.electrical_power(sample.power.electrical_W);
    consumer.mechanical_energy(sample.power.mechanical_energy_J);
    consumer.electrical_energy(sample.power.electrical_energy_J);
  }
  for (std::size_t i = 0; i < cell.devices.size(); ++i) {
    const auto meter = cell.devices[i].meter();
    if (!meter) continue;
    takt_msgs::msg::PowerConsumer& consumer = message.consumers()[place++];
    consumer.name(cell.devices[i].name);
    consumer.mechanical_power().clear();
    consumer.mechanical_total(0.0);
    consumer.electrical_power(snapshot.devices[i].signals[meter->power]);
    consumer.mechanical_energy(0.0);
    consumer.electrical_energy(snapshot.devices[i].signals[meter->energy]);
  }
  return count > 0;
}

takt_msgs::msg::Contacts make_contacts_message(const CellDescription& cell, std::size_t room) {
  takt_msgs::msg::Contacts message;
  message.scenario_generation(cell.scenario_generation);
  message.contacts().resize(room);
  return message;
}

bool fill(takt_msgs::msg::Contacts& message, const Snapshot& snapshot) {
  message.stamp(to_time(snapshot.time_s));
  message.time(snapshot.time_s);
  message.step(snapshot.step);
  message.epoch(snapshot.epoch);
  const std::span<const ContactSample> pressing = snapshot.contacts.pressing();
  message.contacts().resize(pressing.size());
  for (std::size_t i = 0; i < pressing.size(); ++i) {
    const ContactSample& sample = pressing[i];
    takt_msgs::msg::Contact& contact = message.contacts()[i];
    contact.base(sample.base);
    contact.target(sample.target);
    fill(contact.force(), sample.F_base_W.f);
    fill(contact.torque(), sample.F_base_W.t);
    fill(contact.center_of_pressure(), sample.p_WC);
    contact.elements(static_cast<std::uint32_t>(sample.result.elements));
    contact.area(sample.result.area_m2);
    contact.normal_force(sample.result.normal_force_N);
    contact.friction_force(sample.result.friction_force_N);
    contact.largest_pressure(sample.result.largest_pressure_Pa);
    contact.largest_penetration(sample.result.largest_penetration_m);
  }
  message.omitted(snapshot.contacts.omitted);
  return snapshot.contacts.acting;
}

void fill(takt_msgs::msg::ContactPressures& message, const CellDescription& cell, const Snapshot& snapshot,
          const std::vector<PressedPair>& pairs) {
  message.stamp(to_time(snapshot.time_s));
  message.time(snapshot.time_s);
  message.step(snapshot.step);
  message.epoch(snapshot.epoch);
  message.scenario_generation(cell.scenario_generation);
  message.pairs().resize(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    takt_msgs::msg::ContactPressure& pair = message.pairs()[i];
    pair.base(pairs[i].base);
    pair.target(pairs[i].target);
    pair.largest_pressure(pairs[i].largest_pressure_Pa);
    pair.omitted(static_cast<std::uint32_t>(pairs[i].omitted));
    pair.corners().clear();
    pair.pressures().clear();
    for (const PressedElement& element : pairs[i].elements) {
      for (const Vec3& corner : element.corner_B)
        for (const double value : corner) pair.corners().push_back(static_cast<float>(value));
      pair.pressures().push_back(static_cast<float>(element.pressure_Pa));
    }
  }
}

takt_msgs::msg::Status to_message(const LoopStatus& status, const CellDescription& cell) {
  takt_msgs::msg::Status message;
  message.stamp(to_time(status.time_s));
  message.time(status.time_s);
  message.step(status.step);
  message.epoch(status.epoch);
  message.scenario_generation(cell.scenario_generation);
  message.state(static_cast<std::uint8_t>(status.state));
  message.pace(std::string(to_string(status.pace)));
  message.pace_factor(status.pace_factor);
  message.wall_time(status.wall_time_s);
  message.real_time_factor(status.real_time_factor);
  message.computation_ratio(status.computation_ratio);
  message.lag(status.lag_s);
  message.overruns(status.overruns);
  message.max_consecutive_overruns(status.max_consecutive_overruns);
  message.schedule_resets(status.schedule_resets);
  message.step_time_p50(status.step_time.p50_s);
  message.step_time_p99(status.step_time.p99_s);
  message.step_time_max(status.step_time.max_s);
  message.wakeup_latency_p50(status.wakeup_latency.p50_s);
  message.wakeup_latency_p99(status.wakeup_latency.p99_s);
  message.wakeup_latency_max(status.wakeup_latency.max_s);
  message.command_latency_p50(status.command_latency.p50_s);
  message.command_latency_p99(status.command_latency.p99_s);
  message.command_latency_max(status.command_latency.max_s);
  message.commands_applied(status.commands_applied);
  message.commands_rejected(status.commands_rejected);
  message.mpr_calls(status.mpr_calls);
  message.mpr_skipped(status.mpr_skipped);
  message.solver(std::string(status.solver.str()));
  message.solver_steps(status.solver_steps);
  message.solver_rejected_steps(status.solver_rejected_steps);
  for (std::uint32_t i = 0; i < status.process_count; ++i) {
    auto& process = message.processes().emplace_back();
    process.name(utf8_sanitize(cell.processes[i].name, 128));
    process.level_of_detail(status.process_levels[i]);
  }
  for (std::uint32_t i = 0; i < status.waiting_count; ++i) {
    message.waiting_for().emplace_back(utf8_sanitize(status.waiting_for[i].view()));
  }
  message.scheduling(utf8_sanitize(status.scheduling.view()));
  message.fault(utf8_sanitize(status.fault.view()));
  message.contact_pairs(status.contact_pairs);
  message.contact_calls(status.contact_calls.made);
  message.contact_calls_skipped(status.contact_calls.skipped);
  message.contact_elements(status.contact_calls.elements);
  message.contact_rebuilds(status.contact_calls.rebuilds);
  return message;
}

takt_msgs::msg::Event to_message(const EventRecord& event, const CellDescription& cell) {
  const EventText text = describe(event, cell);
  takt_msgs::msg::Event message;
  message.stamp(to_time(event.time_s));
  message.step(event.step);
  message.epoch(event.epoch);
  message.severity(static_cast<std::uint8_t>(event.severity));
  message.code(std::string(to_string(event.code)));
  message.subject(utf8_sanitize(text.subject, 128));
  message.message(utf8_sanitize(text.message, 1024));
  return message;
}

}  // namespace takt
