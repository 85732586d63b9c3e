#include "client_lib/convert.h"

#include <algorithm>

#include "idl/common/stamp.h"

namespace takt::client {
namespace {

Transform transform(const takt_msgs::msg::Vector3& position, const std::vector<double>& rotation) {
  Transform X{position, {}};
  if (rotation.size() == X.rotation.size())
    std::copy(rotation.begin(), rotation.end(), X.rotation.begin());
  else
    X.rotation = Transform{}.rotation;
  return X;
}
Transform transform(const takt_msgs::msg::Transform& wire) {
  return transform(wire.position, wire.rotation);
}

/// Of another version of the server a number may have no name here.
template <typename E>
E known_or(E value, E otherwise) {
  return is_known(value) ? value : otherwise;
}

ComponentInfo component_info(const takt_msgs::msg::ComponentDescription& wire) {
  ComponentInfo info;
  info.name = wire.name;
  info.type = known_or(wire.type, ComponentType::ground);
  info.hierarchy = wire.hierarchy;
  info.mass_kg = wire.mass;
  info.center_of_mass_m = wire.center_of_mass;
  info.mesh_uri = wire.mesh_uri;
  info.vertices_m = wire.vertices;
  info.triangles = wire.triangles;
  if (wire.color.size() == info.color.size())
    std::copy(wire.color.begin(), wire.color.end(), info.color.begin());
  return info;
}

RobotInfo robot_info(const takt_msgs::msg::RobotDescription& wire) {
  RobotInfo info;
  info.name = wire.name;
  info.urdf = wire.urdf;
  for (const auto& joint : wire.joints)
    info.joints.push_back({joint.name, joint.type == JointType::prismatic,
                           transform(joint.position, joint.rotation), joint.axis, joint.lower, joint.upper,
                           joint.max_velocity, joint.max_effort});
  info.X_JF = transform(wire.flange);
  info.X_WR = transform(wire.base);
  info.command_period_s = wire.command_period;
  info.command_deadline_s = wire.command_deadline;
  info.safe_action = known_or(wire.safe_action, SafeAction::stop);
  return info;
}

GripperInfo gripper_info(const takt_msgs::msg::GripperDescription& wire) {
  GripperInfo info;
  info.name = wire.name;
  info.robot = wire.robot;
  info.palm = wire.palm;
  info.left_jaw = wire.left_jaw;
  info.right_jaw = wire.right_jaw;
  info.X_FG = transform(wire.mount);
  info.X_GT = transform(wire.tool_center_point);
  info.max_width_m = wire.max_width;
  info.max_force_N = wire.max_force;
  info.jaw_speed_m_per_s = wire.jaw_speed;
  return info;
}

DeviceInfo device_info(const takt_msgs::msg::DeviceDescription& wire) {
  DeviceInfo info;
  info.name = wire.name;
  for (const auto& signal : wire.signals) info.signals.emplace_back().name = signal;
  for (std::size_t i = 0; i < std::min(info.signals.size(), wire.properties.size()); ++i) {
    const auto& properties = wire.properties[i];
    SignalInfo& signal = info.signals[i];
    signal.unit = properties.unit;
    signal.commanded = properties.commanded;
    signal.lower = properties.lower;
    signal.upper = properties.upper;
  }
  return info;
}

}  // namespace

CellInfo from_wire(const takt_msgs::msg::CellDescription& wire) {
  CellInfo info;
  info.cell = wire.cell;
  info.scenario = wire.scenario;
  info.scenario_generation = wire.scenario_generation;
  info.server_version = wire.server_version;
  info.step_s = wire.step_size;
  info.level_of_detail = wire.level_of_detail;
  info.gravity_m_per_s2 = wire.gravity;
  for (const auto& component : wire.components) info.components.push_back(component_info(component));
  for (const auto& robot : wire.robots) info.robots.push_back(robot_info(robot));
  for (const auto& gripper : wire.grippers) info.grippers.push_back(gripper_info(gripper));
  for (const auto& device : wire.devices) info.devices.push_back(device_info(device));
  return info;
}

Event from_wire(const takt_msgs::msg::Event& wire) {
  Event event;
  event.sequence_number = wire.sequence_number;
  event.time_s = seconds_of(wire.stamp);
  event.step = wire.step;
  event.epoch = wire.epoch;
  event.severity = known_or(wire.severity, Severity::error);
  event.code = wire.code;
  event.subject = wire.subject;
  event.sender = wire.sender;
  event.message = wire.message;
  return event;
}

Status from_wire(const takt_msgs::msg::Status& wire) {
  Status status;
  status.time_s = wire.time;
  status.step = wire.step;
  status.epoch = wire.epoch;
  status.scenario_generation = wire.scenario_generation;
  status.state = known_or(wire.state, SimulationState::no_world);
  status.pace = wire.pace;
  status.pace_factor = wire.pace_factor;
  status.wall_time_s = wire.wall_time;
  status.real_time_factor = wire.real_time_factor;
  status.computation_ratio = wire.computation_ratio;
  status.lag_s = wire.lag;
  status.overruns = wire.overruns;
  status.max_consecutive_overruns = wire.max_consecutive_overruns;
  status.schedule_resets = wire.schedule_resets;
  status.step_time = {wire.step_time_p50, wire.step_time_p99, wire.step_time_max};
  status.wakeup_latency = {wire.wakeup_latency_p50, wire.wakeup_latency_p99, wire.wakeup_latency_max};
  status.command_latency = {wire.command_latency_p50, wire.command_latency_p99, wire.command_latency_max};
  status.commands_applied = wire.commands_applied;
  status.commands_rejected = wire.commands_rejected;
  status.mpr_calls = wire.mpr_calls;
  status.mpr_skipped = wire.mpr_skipped;
  status.solver = wire.solver;
  status.solver_steps = wire.solver_steps;
  status.solver_rejected_steps = wire.solver_rejected_steps;
  status.contact_pairs = wire.contact_pairs;
  status.contact_calls = wire.contact_calls;
  status.contact_calls_skipped = wire.contact_calls_skipped;
  status.contact_elements = wire.contact_elements;
  status.contact_rebuilds = wire.contact_rebuilds;
  for (const auto& process : wire.processes)
    status.processes.push_back({process.name, process.level_of_detail});
  for (const auto& name : wire.waiting_for) status.waiting_for.emplace_back(name);
  status.scheduling = wire.scheduling;
  status.fault = wire.fault;
  return status;
}

Power from_wire(const takt_msgs::msg::Power& wire) {
  Power power;
  power.time_s = wire.time;
  power.step = wire.step;
  power.epoch = wire.epoch;
  for (const auto& consumer : wire.consumers)
    power.consumers.push_back({consumer.name, consumer.mechanical_power, consumer.mechanical_total,
                               consumer.electrical_power, consumer.mechanical_energy,
                               consumer.electrical_energy});
  return power;
}

std::optional<Contacts> from_wire(const takt_msgs::msg::Contacts& wire, const CellInfo& cell) {
  Contacts contacts;
  contacts.time_s = wire.time;
  contacts.step = wire.step;
  contacts.epoch = wire.epoch;
  contacts.omitted = wire.omitted;
  if (wire.scenario_generation != cell.scenario_generation) return std::nullopt;
  const auto known = [&](int component) {
    return component >= 0 && static_cast<std::size_t>(component) < cell.components.size();
  };
  const auto name = [&](int component) { return cell.components[static_cast<std::size_t>(component)].name; };
  contacts.contacts.reserve(wire.contacts.size());
  for (const auto& pair : wire.contacts) {
    if (!known(pair.base) || !known(pair.target)) return std::nullopt;
    contacts.contacts.push_back({name(pair.base), name(pair.target), pair.force, pair.torque,
                                 pair.center_of_pressure, pair.elements, pair.area, pair.normal_force,
                                 pair.friction_force, pair.largest_pressure, pair.largest_penetration});
  }
  return contacts;
}

std::optional<State> from_wire(const takt_msgs::msg::CellState& wire, std::shared_ptr<const CellInfo> cell) {
  if (wire.scenario_generation != cell->scenario_generation ||
      wire.components.size() != cell->components.size() || wire.robots.size() != cell->robots.size() ||
      wire.grippers.size() != cell->grippers.size() || wire.devices.size() != cell->devices.size())
    return std::nullopt;
  State state;
  state.time_s = wire.time;
  state.step = wire.step;
  state.epoch = wire.epoch;
  state.state_hash = wire.state_hash;
  state.components.reserve(wire.components.size());
  const int count = static_cast<int>(wire.components.size());
  for (const auto& component : wire.components) {
    if (component.partner >= count) return std::nullopt;
    const auto& q = component.orientation;
    state.components.push_back({component.position,
                                {q.x, q.y, q.z, q.w},
                                component.linear_velocity,
                                component.angular_velocity,
                                component.force,
                                component.torque,
                                known_or(component.state, PartState::fixed),
                                std::max(component.partner, -1)});
  }
  for (std::size_t i = 0; i < wire.robots.size(); ++i) {
    const auto& robot = wire.robots[i];
    if (robot.position.size() != cell->robots[i].joints.size()) return std::nullopt;
    state.robots.push_back({robot.position, robot.velocity, robot.effort, robot.motor_power});
  }
  for (const auto& gripper : wire.grippers) {
    if (gripper.part >= count) return std::nullopt;
    state.grippers.push_back({gripper.width, gripper.force, gripper.closed, gripper.moving,
                              gripper.in_position, std::max(gripper.part, -1)});
  }
  for (std::size_t i = 0; i < wire.devices.size(); ++i) {
    const auto& signals = wire.devices[i].signals;
    if (signals.size() != cell->devices[i].signals.size()) return std::nullopt;
    state.devices.push_back(signals);
  }
  for (const auto& applied : wire.applied)
    state.applied.push_back({applied.target, applied.count, seconds_of(applied.newest_stamp)});
  state.cell = std::move(cell);
  return state;
}

}  // namespace takt::client
