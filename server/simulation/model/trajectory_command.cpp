// Validation of trajectories and of device commands.
#include <algorithm>
#include <cmath>
#include <optional>

#include "idl/common/text.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/signals.h"

namespace takt {

namespace {

/// Checks one trajectory; the first fault is kept.
class TrajectoryCheck {
 public:
  TrajectoryCheck(const RawTrajectory& raw, const RobotDescription& robot)
      : raw_(raw), robot_(robot), arm_(robot.arm) {}

  std::optional<Rejection> names() {
    const std::size_t n = arm_.joints.size();
    if (raw_.names.size() != n) {
      return fault(RejectionCode::wrong_count,
                   "'joint_names' has " + std::to_string(raw_.names.size()) + " entries; " + robot_.name +
                       " needs " + std::to_string(n) + ", one for each of: " + list_names(arm_.joints));
    }
    for (const std::string& name : raw_.names) {
      std::size_t j = 0;
      while (j < n && arm_.joints[j].name != name) ++j;
      if (j == n) {
        return fault(RejectionCode::unknown_joint, robot_.name + " has no joint '" + name.substr(0, 100) +
                                                       "'; joints: " + list_names(arm_.joints));
      }
      for (const std::size_t other : joint_) {
        if (other == j) return fault(RejectionCode::duplicate_joint, "joint '" + name + "' is given twice");
      }
      joint_.push_back(j);
    }
    return std::nullopt;
  }

  std::optional<Rejection> point(std::size_t i, JointPathPoint& point) {
    const RawTrajectoryPoint& raw = raw_.points[i];
    const RawTrajectoryPoint& first = raw_.points.front();
    const std::size_t n = arm_.joints.size();
    const std::string where = "point " + std::to_string(i + 1);
    point.t = raw.time_from_start_s;
    if (!std::isfinite(point.t))
      return fault(RejectionCode::not_finite, "the time of " + where + " is " + number_text(point.t));
    if (point.t < 0.0 || (i > 0 && !(point.t > raw_.points[i - 1].time_from_start_s))) {
      return fault(RejectionCode::times_not_ascending,
                   "the time of " + where + " is " + number_text(point.t) + " s; it must " +
                       (i == 0 ? std::string("not be negative")
                               : "be after that of the point before, " +
                                     number_text(raw_.points[i - 1].time_from_start_s) + " s"));
    }
    if (point.t > kLongestTime_s) {
      return fault(RejectionCode::out_of_range, "the time of " + where + " is " + number_text(point.t) +
                                                    " s; allowed is up to " + number_text(kLongestTime_s) +
                                                    " s");
    }
    if (!raw.effort.empty() || !first.effort.empty()) {
      if (raw.effort.size() != n) return wrong_count(where, "effort", raw.effort.size());
      if (auto found = effort(raw, where)) return found;
      if (first.effort.empty()) return wrong_count(where, "effort", raw.effort.size());
      for (std::size_t k = 0; k < n; ++k) point.feed_forward[joint_[k]] = raw.effort[k];
    }
    struct Field {
      const char* name;
      const std::vector<double>& values;
      bool wanted;
      JointArray& to;
    };
    for (const Field& field :
         {Field{"positions", raw.positions, true, point.q},
          Field{"velocities", raw.velocities, !first.velocities.empty(), point.qd},
          Field{"accelerations", raw.accelerations, !first.accelerations.empty(), point.qdd}}) {
      if (!field.wanted && field.values.empty()) continue;
      if (!field.wanted || field.values.size() != n)
        return wrong_count(where, field.name, field.values.size());
      for (std::size_t k = 0; k < n; ++k) {
        if (!std::isfinite(field.values[k])) {
          return fault(RejectionCode::not_finite, "one of the " + std::string(field.name) + " of " + where +
                                                      ", of joint '" + raw_.names[k] + "', is " +
                                                      number_text(field.values[k]));
        }
        field.to[joint_[k]] = field.values[k];
      }
    }
    return std::nullopt;
  }

  /// The whole way between two points, or a single one where they are the same.
  std::optional<Rejection> way(const JointPath& path, std::size_t from, std::size_t to) {
    for (std::size_t j = 0; j < arm_.joints.size(); ++j) {
      const JointModel& joint = arm_.joints[j];
      PathPiece piece;
      if (from == to) {
        piece.c[0] = path.points[to].q[j];
        piece.c[1] = path.points[to].qd[j];  // of a piece of 1 s; used as a velocity only
      } else {
        piece = path_piece(path.order, path.points[from], path.points[to], j);
      }
      const bool turns = joint.type == JointType::revolute;
      const auto check = [&](const char* what, const PathPiece& curve, double lower, double upper,
                             const char* unit, RejectionCode code) -> std::optional<Rejection> {
        // A path that runs along a limit may pass it by rounding.
        const double room = 1e-9 * (1.0 + std::abs(upper - lower));
        const double value = value_outside(curve, lower - room, upper + room);
        if (std::isnan(value)) return std::nullopt;
        return fault(code, std::string(what) + " of joint '" + joint.name + "' " +
                               (from == to ? "at point " + std::to_string(to + 1)
                                           : "between points " + std::to_string(from + 1) + " and " +
                                                 std::to_string(to + 1)) +
                               " is " + number_text(value) + " " + unit + ", outside [" + number_text(lower) +
                               ", " + number_text(upper) + "] " + unit);
      };
      const PathPiece velocity = piece.derivative();
      if (from == to) piece.c[1] = 0.0;
      if (auto found = check("position", piece, joint.lower, joint.upper, turns ? "rad" : "m",
                             RejectionCode::out_of_range))
        return found;
      if (auto found = check("velocity", velocity, -joint.max_velocity, joint.max_velocity,
                             turns ? "rad/s" : "m/s", RejectionCode::velocity_out_of_range))
        return found;
    }
    return std::nullopt;
  }

  std::optional<Rejection> rest(const JointPathPoint& last) {
    for (std::size_t j = 0; j < arm_.joints.size(); ++j) {
      if (last.qd[j] == 0.0) continue;
      return fault(RejectionCode::not_at_rest, "joint '" + arm_.joints[j].name + "' still has the velocity " +
                                                   number_text(last.qd[j]) +
                                                   " at the last point; it must be 0");
    }
    return std::nullopt;
  }

  Rejection fault(RejectionCode code, const std::string& message) const {
    return {code, robot_.name, "the trajectory is not followed: " + message};
  }

 private:
  std::optional<Rejection> effort(const RawTrajectoryPoint& raw, const std::string& where) const {
    for (std::size_t k = 0; k < raw.effort.size(); ++k) {
      const JointModel& joint = arm_.joints[joint_[k]];
      const std::string what =
          "effort of joint '" + joint.name + "' at " + where + " is " + number_text(raw.effort[k]);
      if (!std::isfinite(raw.effort[k])) return fault(RejectionCode::not_finite, "the " + what);
      if (std::abs(raw.effort[k]) <= joint.max_effort) continue;
      const std::string unit = joint.type == JointType::revolute ? " N m" : " N";
      return fault(RejectionCode::effort_out_of_range, "the " + what + unit + ", outside [" +
                                                           number_text(-joint.max_effort) + ", " +
                                                           number_text(joint.max_effort) + "]" + unit);
    }
    return std::nullopt;
  }

  Rejection wrong_count(const std::string& where, const char* field, std::size_t found) const {
    return fault(RejectionCode::wrong_count,
                 "'" + std::string(field) + "' of " + where + " has " + std::to_string(found) +
                     " entries; needed are " + std::to_string(arm_.joints.size()) +
                     (std::string_view(field) == "positions" ? "" : ", in all points or in none"));
  }

  const RawTrajectory& raw_;
  const RobotDescription& robot_;
  const ArmModel& arm_;
  std::vector<std::size_t> joint_;  ///< by place in the message
};

}  // namespace

Validated<TrajectoryCommand> validate(const CellDescription& cell, int target, const RawTrajectory& raw) {
  TrajectoryCheck check(raw, cell.robots[static_cast<std::size_t>(target)]);
  if (raw.stamp > SimTime::from_seconds(kLongestTime_s)) {
    return check.fault(RejectionCode::out_of_range,
                       "its stamp is " + number_text(raw.stamp.seconds()) +
                           " s; needed is the simulated time at which it begins, at most " +
                           number_text(kLongestTime_s) +
                           " s, or 0 for now (is it the time of a wall clock?)");
  }
  auto path = std::make_shared<JointPath>();
  if (raw.points.empty()) return TrajectoryCommand{target, raw.stamp, std::move(path)};
  if (raw.points.size() > kMaxTrajectoryPoints) {
    return check.fault(RejectionCode::malformed, "it has " + std::to_string(raw.points.size()) +
                                                     " points; at most " +
                                                     std::to_string(kMaxTrajectoryPoints) + " are possible");
  }
  if (auto fault = check.names()) return *std::move(fault);
  path->points.resize(raw.points.size());
  for (std::size_t i = 0; i < raw.points.size(); ++i) {
    if (auto fault = check.point(i, path->points[i])) return *std::move(fault);
  }
  path->has_feed_forward = !raw.points.front().effort.empty();
  const bool velocities = !raw.points.front().velocities.empty();
  path->order = !velocities                                ? PathOrder::linear
                : raw.points.front().accelerations.empty() ? PathOrder::cubic
                                                           : PathOrder::quintic;
  for (std::size_t i = 0; i < raw.points.size(); ++i) {
    if (auto fault = check.way(*path, i == 0 ? 0 : i - 1, i)) return *std::move(fault);
  }
  if (auto fault = check.rest(path->points.back())) return *std::move(fault);
  return TrajectoryCommand{target, raw.stamp, std::move(path)};
}

std::optional<Rejection> add_signal(const CellDescription& cell, DeviceCommand& command, int signal,
                                    double value) {
  const DeviceDescription& device = cell.devices[static_cast<std::size_t>(command.device)];
  const SignalDescription& description = device.signals[static_cast<std::size_t>(signal)];
  const auto name = [&] { return "signal '" + description.name + "'"; };
  const auto reject = [&](RejectionCode code, const std::string& message) {
    return Rejection{code, device.name, message};
  };
  if (!description.commanded)
    return reject(RejectionCode::read_only_signal, name() + " of " + device.name + " can only be read");
  if (const SignalWire* wire = wire_to(cell, {command.device, signal}))
    return reject(RejectionCode::wired_signal, name() + " of " + device.name + " is wired to '" + wire->text +
                                                   "', so it cannot be commanded; force_signal sets it");
  const auto end = command.signals.begin() + command.count;
  if (std::find(command.signals.begin(), end, signal) != end)
    return reject(RejectionCode::malformed, name() + " is given twice");
  if (!std::isfinite(value))
    return reject(RejectionCode::not_finite,
                  name() + " is " + number_text(value) + "; a finite number is needed");
  if (value < description.lower || value > description.upper) {
    return reject(RejectionCode::out_of_range, name() + " of " + device.name + " is " + number_text(value) +
                                                   " " + description.unit + ", outside [" +
                                                   number_text(description.lower) + ", " +
                                                   number_text(description.upper) + "] " + description.unit);
  }
  if (description.type != SignalType::real && value != std::floor(value))
    return reject(RejectionCode::wrong_type,
                  name() + " of " + device.name + " is " + number_text(value) + "; it is " +
                      (description.type == SignalType::boolean ? "boolean: 0 or 1" : "a whole number"));
  const auto place = static_cast<std::size_t>(command.count++);
  command.signals[place] = static_cast<std::uint8_t>(signal);
  command.values[place] = value;
  return std::nullopt;
}

void add_other_signals(const DeviceCommand& earlier, DeviceCommand& newer) {
  for (int i = 0; i < earlier.count; ++i) {
    const auto from = static_cast<std::size_t>(i);
    const auto end = newer.signals.begin() + newer.count;
    if (std::find(newer.signals.begin(), end, earlier.signals[from]) != end) continue;
    const auto to = static_cast<std::size_t>(newer.count++);
    newer.signals[to] = earlier.signals[from];
    newer.values[to] = earlier.values[from];
  }
}

Validated<DeviceCommand> validate(const CellDescription& cell, int target, const RawDeviceCommand& raw) {
  DeviceCommand command;
  command.device = target - static_cast<int>(cell.robots.size() + cell.grippers.size());
  command.stamp = raw.stamp;
  const DeviceDescription& device = cell.devices[static_cast<std::size_t>(command.device)];
  if (raw.signals.size() != raw.values.size() || raw.signals.size() > static_cast<std::size_t>(kMaxSignals)) {
    return Rejection{RejectionCode::wrong_count, device.name,
                     "there are " + std::to_string(raw.signals.size()) + " signals and " +
                         std::to_string(raw.values.size()) +
                         " values; needed is one value for each of at most " + std::to_string(kMaxSignals) +
                         " signals"};
  }
  for (std::size_t i = 0; i < raw.signals.size(); ++i) {
    const auto found = std::find_if(device.signals.begin(), device.signals.end(),
                                    [&](const auto& signal) { return signal.name == raw.signals[i]; });
    if (found == device.signals.end()) {
      return Rejection{RejectionCode::unknown_signal, device.name,
                       device.name + " has no signal '" + raw.signals[i].substr(0, 100) +
                           "'; signals: " + list_names(device.signals)};
    }
    if (auto fault =
            add_signal(cell, command, static_cast<int>(found - device.signals.begin()), raw.values[i]))
      return *std::move(fault);
  }
  return command;
}

}  // namespace takt
