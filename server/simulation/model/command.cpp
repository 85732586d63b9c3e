#include "server/simulation/model/command.h"

#include <array>
#include <cmath>

#include "idl/common/text.h"
#include "server/simulation/model/cell_description.h"
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

std::string_view to_string(RejectionCode code) {
  constexpr std::array<std::string_view, 18> names{
      "unknown_robot",  "unknown_gripper", "unknown_joint",         "duplicate_joint",     "wrong_count",
      "not_finite",     "out_of_range",    "velocity_out_of_range", "effort_out_of_range", "stale",
      "not_owner",      "malformed",       "invalid_request",       "times_not_ascending", "not_at_rest",
      "unknown_device", "unknown_signal",  "read_only_signal"};
  return names[static_cast<std::size_t>(code)];
}

std::string_view to_string(PartState state) {
  constexpr std::array<std::string_view, 5> names{"free", "grasped", "placed", "assembled", "fixed"};
  return names[static_cast<std::size_t>(state)];
}

Validated<JointCommand> validate(const CellDescription& cell, const RawJointCommand& raw) {
  const int robot = cell.find_robot(raw.robot);
  if (robot < 0) {
    return reject(RejectionCode::unknown_robot, raw.robot,
                  "there is no robot '" + raw.robot + "' in this cell; robots: " + list_names(cell.robots));
  }
  const ArmModel& arm = cell.robots[static_cast<std::size_t>(robot)].arm;
  const auto count = static_cast<std::size_t>(arm.joint_count());
  const auto wrong_count = [&](const char* field, std::size_t found) {
    return reject(RejectionCode::wrong_count, raw.robot,
                  std::string("field '") + field + "' has " + std::to_string(found) + " entries; " +
                      raw.robot + " needs " + std::to_string(count) +
                      ", one for each of: " + list_names(arm.joints));
  };
  if (raw.names.size() != count) return wrong_count("name", raw.names.size());
  if (raw.position.size() != count) return wrong_count("position", raw.position.size());
  if (!raw.velocity.empty() && raw.velocity.size() != count)
    return wrong_count("velocity", raw.velocity.size());
  if (!raw.effort.empty() && raw.effort.size() != count) return wrong_count("effort", raw.effort.size());
  if (!std::isfinite(raw.stamp_s))
    return reject(RejectionCode::not_finite, raw.robot, "the stamp is not finite");

  JointCommand command;
  command.robot = robot;
  command.stamp_s = raw.stamp_s;
  command.has_velocity = !raw.velocity.empty();
  command.has_effort = !raw.effort.empty();
  std::array<bool, kMaxJoints> seen{};
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t j = 0;
    while (j < count && arm.joints[j].name != raw.names[i]) ++j;
    if (j == count) {
      return reject(RejectionCode::unknown_joint, raw.robot,
                    raw.robot + " has no joint '" + raw.names[i].substr(0, 100) +
                        "'; joints: " + list_names(arm.joints));
    }
    if (seen[j]) {
      return reject(RejectionCode::duplicate_joint, raw.robot, "joint '" + raw.names[i] + "' is given twice");
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
        return reject(RejectionCode::not_finite, raw.robot,
                      std::string(check.quantity) + " of joint '" + joint.name + "' is " +
                          number_text(value) + "; a finite number is needed");
      }
      const std::string fault =
          outside(check.quantity, joint.name, value, check.lower, check.upper, check.unit);
      if (!fault.empty()) return reject(check.code, raw.robot, fault);
    }
    command.position[j] = raw.position[i];
    if (command.has_velocity) command.velocity[j] = raw.velocity[i];
    if (command.has_effort) command.effort[j] = raw.effort[i];
  }
  return command;
}

Validated<GripperCommand> validate(const CellDescription& cell, const RawGripperCommand& raw) {
  const int gripper = cell.find_gripper(raw.gripper);
  if (gripper < 0) {
    return reject(
        RejectionCode::unknown_gripper, raw.gripper,
        "there is no gripper '" + raw.gripper + "' in this cell; grippers: " + list_names(cell.grippers));
  }
  const GripperDescription& description = cell.grippers[static_cast<std::size_t>(gripper)];
  if (raw.action > 2) {
    return reject(RejectionCode::malformed, raw.gripper,
                  "action " + std::to_string(raw.action) + " is unknown; allowed: 0 open, 1 close, 2 width");
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
          RejectionCode::not_finite, raw.gripper,
          std::string(check.name) + " is " + number_text(check.value) + "; a finite number is needed");
    }
    if (check.value < 0.0 || check.value > check.upper) {
      return reject(RejectionCode::out_of_range, raw.gripper,
                    std::string(check.name) + " " + number_text(check.value) + " " + check.unit +
                        " is outside [0, " + number_text(check.upper) + "] " + check.unit);
    }
  }
  if (!std::isfinite(raw.stamp_s))
    return reject(RejectionCode::not_finite, raw.gripper, "the stamp is not finite");
  return GripperCommand{gripper, raw.stamp_s, static_cast<GripperAction>(raw.action), raw.width_m,
                        raw.max_force_N};
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

std::uint64_t period_boundary_step(std::uint64_t k, double period_s, double step_s) {
  // The small tolerance keeps k * period / step, when it is a whole number, from being rounded up by its last
  // bit.
  return static_cast<std::uint64_t>(std::ceil(static_cast<double>(k) * period_s / step_s - 1e-6));
}

}  // namespace takt
