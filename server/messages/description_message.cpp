#include "server/messages/description_message.h"

#include <type_traits>
#include <vector>

#include "idl/common/eigen_messages.h"
#include "idl/common/utf8.h"

namespace takt {
namespace {

constexpr FieldInfo kWhole{};
constexpr std::size_t kMaxProcesses = field_info<takt_msgs::msg::Status>("processes").bound;

/// The first value of a message that is beyond a bound of the IDL, which readers refuse whole, or no text: a name that
/// is cut off or has another character would be another name.
struct Faults {
  template <typename Value>
  static std::string of(const FieldInfo&, const std::string&, const Value&) {
    return {};
  }
  static std::string of(const FieldInfo& field, const std::string& path, const std::string& text) {
    const LineBreaks lines = field.name == "urdf" ? LineBreaks::allow : LineBreaks::refuse;
    const std::string what = path + " '" + utf8_sanitize(text, 60) + "...'";
    if (!validate_utf8(text, lines))
      return what + " is no text; it must be UTF-8 without control characters.";
    if (field.string_bound == 0 || text.size() <= field.string_bound) return {};
    return what + " has " + std::to_string(text.size()) + " bytes; messages have room for " +
           std::to_string(field.string_bound) + ".";
  }
  template <Message Type>
  static std::string of(const FieldInfo&, const std::string& path, const Type& message) {
    std::string fault;
    for_each_field(message, [&](const FieldInfo& field, const auto& value) {
      if (fault.empty()) fault = of(field, path + (path.empty() ? "" : ".") + std::string(field.name), value);
    });
    return fault;
  }
  template <typename Value>
  static std::string of(const FieldInfo& field, const std::string& path, const std::vector<Value>& values) {
    if (field.bound > 0 && values.size() > field.bound)
      return "The cell has " + std::to_string(values.size()) + " " + path + "; messages have room for " +
             std::to_string(field.bound) + ".";
    std::string fault;
    if constexpr (!std::is_arithmetic_v<Value>)
      for (std::size_t i = 0; i < values.size() && fault.empty(); ++i)
        fault = of(field, path + "[" + std::to_string(i) + "]", values[i]);
    return fault;
  }
};

takt_msgs::msg::Transform to_transform(const Pose& X) {
  return {to_vector(X.p), to_rotation_matrix(X.R)};
}

takt_msgs::msg::ComponentDescription to_message(const ComponentDescription& component) {
  if (component.mesh->triangles.size() / 3 > kMaxTriangles)
    throw MessageError("The mesh of '" + component.name + "' has " +
                       std::to_string(component.mesh->triangles.size() / 3) +
                       " triangles; messages have room for " + std::to_string(kMaxTriangles) + ".");
  takt_msgs::msg::ComponentDescription message;
  message.name = component.name;
  message.type = component.type;
  message.hierarchy = component.hierarchy;
  message.mass = component.mass_kg;
  message.center_of_mass = to_vector(component.p_BBcm);
  message.mesh_uri = utf8_sanitize(component.mesh_uri);
  message.vertices = component.mesh->vertices;
  message.triangles = component.mesh->triangles;
  message.color = {component.color.begin(), component.color.end()};
  return message;
}

takt_msgs::msg::RobotDescription to_message(const RobotDescription& robot) {
  takt_msgs::msg::RobotDescription message;
  message.name = robot.name;
  message.urdf = utf8_sanitize(robot.urdf, robot.urdf.size(), LineBreaks::allow);
  for (const JointModel& joint : robot.arm.joints) {
    takt_msgs::msg::JointDescription described;
    described.name = joint.name;
    described.type = joint.type;
    described.origin = to_transform(joint.X_PJ);
    described.axis = to_vector(joint.axis);
    described.lower = joint.lower;
    described.upper = joint.upper;
    described.max_velocity = joint.max_velocity;
    described.max_effort = joint.max_effort;
    message.joints.push_back(described);
  }
  message.flange = to_transform(robot.arm.X_JF);
  message.base = to_transform(robot.X_WR);
  message.mounted_on = robot.mount;
  message.mount = to_transform(robot.X_MR);
  message.command_period = robot.command_period_s;
  message.command_deadline = robot.command_deadline.deadline_s;
  message.safe_action = robot.command_deadline.action;
  return message;
}

takt_msgs::msg::GripperDescription to_message(const GripperDescription& gripper) {
  takt_msgs::msg::GripperDescription message;
  message.name = gripper.name;
  message.robot = gripper.robot;
  message.palm = gripper.component;
  message.left_jaw = gripper.left_jaw;
  message.right_jaw = gripper.right_jaw;
  message.mount = to_transform(gripper.X_FG);
  message.tool_center_point = to_transform(gripper.X_GT);
  message.max_width = gripper.max_width_m;
  message.max_force = gripper.max_force_N;
  message.jaw_speed = gripper.jaw_speed_m_per_s;
  return message;
}

takt_msgs::msg::DeviceDescription to_message(const DeviceDescription& device) {
  takt_msgs::msg::DeviceDescription message;
  message.name = device.name;
  message.type = device.type;
  message.robot = device.robot;
  message.mount = to_transform(device.X_FD);
  for (const SignalDescription& signal : device.signals)
    message.signals.push_back({std::string(signal.name),
                               std::string(signal.unit),
                               signal.commanded,
                               signal.lower,
                               signal.upper,
                               signal.type,
                               {}});
  return message;
}

}  // namespace

takt_msgs::msg::CellDescription to_message(const CellDescription& cell, const std::string& server_version) {
  takt_msgs::msg::CellDescription message;
  message.cell = cell.cell;
  message.scenario = cell.scenario;
  message.scenario_generation = cell.scenario_generation;
  message.server_version = server_version;
  message.step_size = cell.step_s;
  message.level_of_detail = cell.level_of_detail;
  message.gravity = to_vector(cell.gravity_m_per_s2);
  for (const auto& component : cell.components) message.components.push_back(to_message(component));
  for (const auto& robot : cell.robots) message.robots.push_back(to_message(robot));
  for (const auto& gripper : cell.grippers) message.grippers.push_back(to_message(gripper));
  for (const auto& device : cell.devices) message.devices.push_back(to_message(device));
  for (const SignalWire& wire : cell.wires)
    if (const auto device = static_cast<std::size_t>(wire.to.device); device < cell.devices.size())
      message.devices[device].signals[static_cast<std::size_t>(wire.to.signal)].wire = wire.text;
  if (std::string fault = Faults::of(kWhole, "", message); !fault.empty()) throw MessageError(fault);
  if (cell.processes.size() > kMaxProcesses)
    throw MessageError("The cell has " + std::to_string(cell.processes.size()) +
                       " processes; messages have room for " + std::to_string(kMaxProcesses) + ".");
  return message;
}

}  // namespace takt
