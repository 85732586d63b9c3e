#include "server/simulation/model/command.h"

#include <cmath>

#include "idl/common/text.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/signals.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

namespace {

Rejection reject(RejectionCode code, const std::string& subject, const std::string& message) {
  return {code, subject, message};
}

// One value against an interval; empty text means it may pass.
std::string outside(const char* quantity, const std::string& joint, double value, double lower, double upper,
                    const char* unit) {
  if (value >= lower && value <= upper) return {};
  return std::string(quantity) + " " + number_text(value) + " " + unit + " of joint '" + joint +
         "' is outside [" + number_text(lower) + ", " + number_text(upper) + "] " + unit;
}

}  // namespace

Validated<JointCommand> validate(const CellDescription& cell, int target, const RawJointCommand& raw) {
  const std::string& name = cell.robots[static_cast<std::size_t>(target)].name;
  const ArmModel& arm = cell.robots[static_cast<std::size_t>(target)].arm;
  const auto count = static_cast<std::size_t>(arm.joint_count());
  const auto wrong_count = [&](const char* field, std::size_t found) {
    return reject(RejectionCode::wrong_count, name,
                  std::string("field '") + field + "' has " + std::to_string(found) + " entries; " + name +
                      " needs " + std::to_string(count) + ", one for each of: " + list_names(arm.joints));
  };
  if (raw.names.size() != count) return wrong_count("name", raw.names.size());
  const bool torque_mode = raw.position.empty() && raw.velocity.empty() && !raw.effort.empty();
  if (!torque_mode && raw.position.size() != count) return wrong_count("position", raw.position.size());
  if (!raw.velocity.empty() && raw.velocity.size() != count)
    return wrong_count("velocity", raw.velocity.size());
  if (!raw.effort.empty() && raw.effort.size() != count) return wrong_count("effort", raw.effort.size());

  JointCommand command;
  command.robot = target;
  command.stamp = raw.stamp;
  command.has_velocity = !raw.velocity.empty();
  command.has_effort = !raw.effort.empty();
  command.torque_mode = torque_mode;
  std::array<bool, kMaxJoints> seen{};
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t j = 0;
    while (j < count && arm.joints[j].name != raw.names[i]) ++j;
    if (j == count) {
      return reject(
          RejectionCode::unknown_joint, name,
          name + " has no joint '" + raw.names[i].substr(0, 100) + "'; joints: " + list_names(arm.joints));
    }
    if (seen[j]) {
      return reject(RejectionCode::duplicate_joint, name, "joint '" + raw.names[i] + "' is given twice");
    }
    seen[j] = true;
    const JointModel& joint = arm.joints[j];
    const bool turns = joint.type == JointType::revolute;
    struct Check {
      const char* quantity;
      const std::vector<double>& values;
      double lower, upper;
      const char* unit;
      RejectionCode code;
    };
    const std::array<Check, 3> checks{{{"position", raw.position, joint.lower, joint.upper,
                                        turns ? "rad" : "m", RejectionCode::out_of_range},
                                       {"velocity", raw.velocity, -joint.max_velocity, joint.max_velocity,
                                        turns ? "rad/s" : "m/s", RejectionCode::velocity_out_of_range},
                                       {"effort", raw.effort, -joint.max_effort, joint.max_effort,
                                        turns ? "N m" : "N", RejectionCode::effort_out_of_range}}};
    for (const Check& check : checks) {
      if (check.values.empty()) continue;
      const double value = check.values[i];
      if (!std::isfinite(value)) {
        return reject(RejectionCode::not_finite, name,
                      std::string(check.quantity) + " of joint '" + joint.name + "' is " +
                          number_text(value) + "; a finite number is needed");
      }
      const std::string fault =
          outside(check.quantity, joint.name, value, check.lower, check.upper, check.unit);
      if (!fault.empty()) return reject(check.code, name, fault);
    }
    if (!torque_mode) command.position[j] = raw.position[i];
    if (command.has_velocity) command.velocity[j] = raw.velocity[i];
    if (command.has_effort) command.effort[j] = raw.effort[i];
  }
  return command;
}

Validated<GripperCommand> validate(const CellDescription& cell, int target, const RawGripperCommand& raw) {
  const int gripper = target - static_cast<int>(cell.robots.size());
  const GripperDescription& description = cell.grippers[static_cast<std::size_t>(gripper)];
  for (const GripperSignal input : {GripperSignal::close, GripperSignal::set_width}) {
    const int device = gripper_as_device(cell, static_cast<std::size_t>(gripper));
    if (const SignalWire* wire = wire_to(cell, {device, static_cast<int>(input)}))
      return reject(RejectionCode::wired_signal, description.name,
                    std::string(to_string(input)) + " is wired to '" + wire->text +
                        "', so the gripper cannot be commanded; force_signal sets it");
  }
  if (!is_known(raw.action)) {
    return reject(RejectionCode::malformed, description.name,
                  "action " + std::to_string(static_cast<int>(raw.action)) +
                      " is unknown; allowed: 0 open, 1 close, 2 width");
  }
  struct Check {
    const char* name;
    double value, upper;
    const char* unit;
  };
  for (const Check& check : {Check{"width", raw.width_m, description.max_width_m, "m"},
                             Check{"max_force", raw.max_force_N, description.max_force_N, "N"}}) {
    if (!std::isfinite(check.value)) {
      return reject(
          RejectionCode::not_finite, description.name,
          std::string(check.name) + " is " + number_text(check.value) + "; a finite number is needed");
    }
    if (check.value < 0.0 || check.value > check.upper) {
      return reject(RejectionCode::out_of_range, description.name,
                    std::string(check.name) + " " + number_text(check.value) + " " + check.unit +
                        " is outside [0, " + number_text(check.upper) + "] " + check.unit);
    }
  }
  return GripperCommand{gripper, raw.stamp, raw.action, raw.width_m, raw.max_force_N};
}

int target_count(const CellDescription& cell) {
  return static_cast<int>(cell.robots.size() + cell.grippers.size() + cell.devices.size());
}

int target_of(const CellDescription& cell, const Command& command) {
  const auto robots = static_cast<int>(cell.robots.size());
  if (const auto* joints = std::get_if<JointCommand>(&command)) return joints->robot;
  if (const auto* trajectory = std::get_if<TrajectoryCommand>(&command)) return trajectory->robot;
  if (const auto* gripper = std::get_if<GripperCommand>(&command)) return robots + gripper->gripper;
  return robots + static_cast<int>(cell.grippers.size()) + std::get<DeviceCommand>(command).device;
}

namespace {
template <typename Items>
int find_by_name(const Items& items, std::string_view name) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return -1;
}
}  // namespace

std::optional<DeviceDescription::Meter> DeviceDescription::meter() const {
  const int power = find_by_name(signals, "power"), energy = find_by_name(signals, "energy");
  if (power < 0 || energy < 0) return std::nullopt;
  return Meter{static_cast<std::size_t>(power), static_cast<std::size_t>(energy)};
}

std::string_view target_name(const CellDescription& cell, int target) {
  auto index = static_cast<std::size_t>(target);
  if (target < 0) return "";
  if (index < cell.robots.size()) return cell.robots[index].name;
  index -= cell.robots.size();
  if (index < cell.grippers.size()) return cell.grippers[index].name;
  return cell.devices[index - cell.grippers.size()].name;
}

int find_target(const CellDescription& cell, std::string_view name) {
  const int count = target_count(cell);
  for (int target = 0; target < count; ++target)
    if (target_name(cell, target) == name) return target;
  return -1;
}

std::optional<std::array<Vec3, 2>> ComponentDescription::box() const {
  const std::vector<float>& vertices = mesh->vertices;
  if (vertices.size() < 3) return std::nullopt;
  const auto vertex = [&](std::size_t i) { return Vec3(vertices[i], vertices[i + 1], vertices[i + 2]); };
  std::array<Vec3, 2> box{vertex(0), vertex(0)};
  for (std::size_t i = 3; i + 2 < vertices.size(); i += 3) {
    box[0] = box[0].cwiseMin(vertex(i));
    box[1] = box[1].cwiseMax(vertex(i));
  }
  return box;
}

int CellDescription::find_component(std::string_view name) const {
  return find_by_name(components, name);
}
int CellDescription::find_robot(std::string_view name) const {
  return find_by_name(robots, name);
}
int CellDescription::find_device(std::string_view name) const {
  return find_by_name(devices, name);
}
int CellDescription::find_process(std::string_view name) const {
  return find_by_name(processes, name);
}
int CellDescription::find_gripper(std::string_view name) const {
  return find_by_name(grippers, name);
}

}  // namespace takt
