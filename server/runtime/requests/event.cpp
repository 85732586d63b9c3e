#include "server/runtime/requests/event.h"

#include <cstdio>
#include <variant>

#include "idl/common/text.h"
#include "server/contact/clearance/clearance_model.h"
#include "server/simulation/model/command.h"
#include "server/simulation/step/simulation.h"

namespace takt {
namespace detail {
namespace {

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  char text[120];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string name_of(std::string_view kind, std::int32_t index, const CellDescription& cell) {
  if (index < 0) return kind == "processes" ? "all processes" : "nothing";
  const auto at = static_cast<std::size_t>(index);
  if (kind == "components") return cell.components[at].name;
  if (kind == "robots") return cell.robots[at].name;
  if (kind == "grippers") return cell.grippers[at].name;
  if (kind == "devices") return cell.devices[at].name;
  if (kind == "processes") return cell.processes[at].name;
  if (kind == "devices") return cell.devices[at].name;
  if (kind == "checked_bodies") return cell.checked_bodies[at];
  return std::string(target_name(cell, index));
}

/// Position of the brace that closes the text at `at`.
std::size_t closing_brace(std::string_view text, std::size_t at) {
  for (int depth = 1; at < text.size(); ++at) {
    depth += text[at] == '{' ? 1 : text[at] == '}' ? -1 : 0;
    if (depth == 0) return at;
  }
  return text.size();
}

void append(std::string& sentence, std::string_view says, std::span<const FieldText> fields) {
  while (!says.empty()) {
    const std::size_t open = says.find('{');
    sentence += says.substr(0, open);
    if (open == std::string_view::npos) return;
    const std::size_t close = closing_brace(says, open + 1);
    std::string_view inside = says.substr(open + 1, close - open - 1);
    says.remove_prefix(std::min(close + 1, says.size()));
    const char condition = inside.front() == '?' || inside.front() == '!' ? inside.front() : '\0';
    if (condition != '\0') inside.remove_prefix(1);
    const std::size_t colon = condition != '\0' ? inside.find(':') : std::string_view::npos;
    for (const FieldText& field : fields) {
      if (field.name != inside.substr(0, colon)) continue;
      if (condition == '\0')
        sentence += field.text;
      else if (field.given == (condition == '?'))
        append(sentence, inside.substr(colon + 1), fields);
    }
  }
}

}  // namespace

FieldText text_of_field(const FieldInfo& field, double value, const CellDescription&) {
  const std::string_view shown = annotation(field.annotations, "shown");
  const bool plain =
      field.unit.empty() || field.unit == "1" || field.unit.find('|') != std::string_view::npos;
  std::string text;
  if (shown == "mm")
    text = formatted("%.3f mm", 1e3 * value);
  else if (shown == "ms")  // to the millisecond
    text = formatted("%.3f s", value);
  else if (shown == "s")
    text = formatted("%.1f s", value);
  else
    text = formatted("%.9g", value) + (plain ? "" : " " + std::string(field.unit));
  return {field.name, text, value != 0.0};
}
FieldText text_of_field(const FieldInfo& field, std::int32_t value, const CellDescription& cell) {
  const std::string_view kind = annotation(field.annotations, "index");
  if (kind.empty()) return {field.name, std::to_string(value), value != 0};
  return {field.name, name_of(kind, value, cell), value >= 0};
}
FieldText text_of_field(const FieldInfo& field, std::uint64_t value, const CellDescription&) {
  return {field.name, std::to_string(value), value != 0};
}
FieldText text_of_field(const FieldInfo& field, bool value, const CellDescription&) {
  return {field.name, value ? "true" : "false", value};
}
FieldText text_of_field(const FieldInfo& field, std::string_view value, const CellDescription&) {
  return {field.name, std::string(value), !value.empty()};
}
FieldText text_of_field(const FieldInfo& field, const takt_msgs::msg::Vector3& value,
                        const CellDescription&) {
  return {field.name, formatted("(%.4f, %.4f, %.4f) ", value.x, value.y, value.z) + std::string(field.unit)};
}

EventText render(const EventInfo& info, std::span<const FieldText> fields, const CellDescription& cell) {
  EventText text;
  append(text.subject, info.subject, fields);
  if (info.subject.empty()) text.subject = cell.cell;
  append(text.message, info.says, fields);
  if (!info.remedy.empty()) text.message.append(" ").append(info.remedy);
  return text;
}

}  // namespace detail

namespace {

takt_msgs::msg::Vector3 vector_message(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

events::OfLoop event_of(const CollisionEvent& found) {
  const takt_msgs::msg::Vector3 position = vector_message(found.p_W);
  switch (found.kind) {
    case CollisionEvent::Kind::collision:
      return events::Collision{found.a, found.b, -found.distance_m, position};
    case CollisionEvent::Kind::clearance_restored:
      return events::ClearanceRestored{
          found.a,          found.b,       found.duration_s, std::max(-found.distance_m, 0.0),
          found.distance_m, found.limit_m, position};
    case CollisionEvent::Kind::clearance:
      break;
  }
  return events::Clearance{found.a, found.b, found.distance_m, found.limit_m, position};
}

events::OfLoop event_of(const MotionNotice& notice, const CellDescription& cell) {
  const RobotDescription& robot = cell.robots[static_cast<std::size_t>(notice.robot)];
  switch (notice.kind) {
    case MotionNotice::Kind::trajectory_done:
      return events::TrajectoryDone{notice.robot};
    case MotionNotice::Kind::trajectory_replaced:
      return events::TrajectoryReplaced{notice.robot};
    case MotionNotice::Kind::trajectory_past:
      return events::TrajectoryPast{notice.robot, notice.value};
    case MotionNotice::Kind::deadline_missed:
      return events::CommandDeadlineMissed{notice.robot, notice.value, robot.command_deadline.deadline_s,
                                           robot.command_deadline.action};
    case MotionNotice::Kind::motion_refused:
      return events::MotionRefused{notice.robot};
    case MotionNotice::Kind::torques_refused:
      return events::TorquesRefused{
          notice.robot,
          FixedString<128>(
              notice.joint < 0
                  ? std::string_view{}
                  : std::string_view(robot.arm.joints[static_cast<std::size_t>(notice.joint)].name))};
    case MotionNotice::Kind::trajectory_refused:
    case MotionNotice::Kind::torques_ended:
      break;
  }
  const JointModel& joint = robot.arm.joints[static_cast<std::size_t>(notice.joint)];
  const bool turns = joint.type == JointType::revolute;
  const auto outside = [&]<typename Event>() {
    return Event{notice.robot,
                 FixedString<128>(joint.name),
                 FixedString<16>(notice.velocity ? "velocity" : "position"),
                 FixedString<8>(notice.velocity ? (turns ? "rad/s" : "m/s") : (turns ? "rad" : "m")),
                 notice.value,
                 notice.lower,
                 notice.upper};
  };
  if (notice.kind == MotionNotice::Kind::torques_ended) return outside.operator()<events::TorquesEnded>();
  return outside.operator()<events::TrajectoryRefused>();
}

events::OfLoop event_of(const DeviceNotice& notice) {
  switch (notice.kind) {
    case DeviceNotice::Kind::part_entered:
      return events::PartEntered{notice.device, notice.part};
    case DeviceNotice::Kind::part_lost:
      return events::PartLost{notice.device, notice.part, notice.load_N, notice.force_N};
    case DeviceNotice::Kind::axis_overloaded:
    case DeviceNotice::Kind::table_overloaded: {
      events::AxisOverloaded event;
      event.device = notice.device;
      event.unit = FixedString<8>(notice.kind == DeviceNotice::Kind::table_overloaded ? "N m" : "N");
      event.load = notice.load_N;
      event.limit = notice.force_N;
      return event;
    }
    case DeviceNotice::Kind::motion_stopped:
      return events::MotionStopped{notice.device};
    case DeviceNotice::Kind::motion_released:
      return events::MotionReleased{notice.device};
    case DeviceNotice::Kind::part_removed:
    case DeviceNotice::Kind::part_taken_off:
      break;
  }
  return events::PartRemoved{notice.device, notice.part, notice.other};
}

}  // namespace

const EventInfo& info_of(const EventRecord& record) {
  return std::visit([]<typename Type>(const Type&) -> const EventInfo& { return event_info<Type>(); },
                    record.event);
}

void report_step(const Simulation& simulation, const std::function<void(const EventRecord&)>& report) {
  const auto at = [&](const auto& found, const events::OfLoop& event) {
    report({found.time_s, found.step, simulation.epoch(), 0, event});
  };
  const StepEvents found_in_step = simulation.events();
  for (const ConnectionChange& change : found_in_step.connection_changes)
    at(change, events::ConnectionChanged{change.part, change.from, change.to});
  for (const MotionNotice& notice : found_in_step.motion_notices)
    at(notice, event_of(notice, simulation.description()));
  for (const CollisionEvent& found : found_in_step.collision_events) at(found, event_of(found));
  for (const WeakGrip& grip : found_in_step.weak_grips)
    at(grip, events::WeakGrip{grip.gripper, grip.part, grip.force_N, grip.needed_N});
  for (const DeviceNotice& notice : found_in_step.device_notices) at(notice, event_of(notice));
  for (const AlternatingForce& force : found_in_step.alternating_forces)
    at(force, events::AlternatingForce{force.part, force.other, force.change_N});
  for (const DeviceMessage& message : found_in_step.device_messages)
    at(message, events::DeviceFailed{message.device, FixedString<640>(message.sentence)});
}

EventRecord fault_record(const Simulation& simulation) {
  return {simulation.time_s(), simulation.step_index(), simulation.epoch(), 0,
          events::SimulationFault{FixedString<640>(simulation.fault())}};
}

EventText describe(const EventRecord& record, const CellDescription& cell) {
  return std::visit([&](const auto& event) { return describe(event, cell); }, record.event);
}

std::string_view words_of(SimulationState state) {
  if (state == SimulationState::no_scenario) return "without a scenario";
  if (state == SimulationState::loading_scenario) return "loading a scenario";
  return to_string(state);
}

}  // namespace takt
