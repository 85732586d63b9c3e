#include "server/dds/command_topics.h"

#include <string_view>
#include <vector>

#include "idl/common/text.h"
#include "server/simulation/model/command.h"
#include "takt_topics.h"

namespace takt {
namespace {

/// A type as users write it: std_msgs/msg/String for std_msgs::msg::dds_::String_. Another one unchanged.
std::string ros_name(std::string_view type) {
  constexpr std::string_view kMark = "::dds_::";
  const auto mark = type.find(kMark);
  if (mark == std::string_view::npos || !type.ends_with('_')) return "'" + std::string(type) + "'";
  std::string name(type.substr(0, mark));
  if (const auto colons = name.find("::"); colons != std::string::npos) name.replace(colons, 2, "/");
  const std::size_t last = mark + kMark.size();
  return name + "/" + std::string(type.substr(last, type.size() - last - 1));
}

}  // namespace

const TopicInfo& topic_of(CommandKind kind) {
  switch (kind) {
    case CommandKind::joints:
      return topics::joint_commands;
    case CommandKind::trajectory:
      return topics::joint_trajectory;
    case CommandKind::gripper:
      return topics::gripper_command;
    case CommandKind::several:
      return topics::commands;
    case CommandKind::device:
      break;
  }
  return topics::device_command;
}

std::optional<CommandTopic> command_topic(const TopicNames& names, const std::string& topic,
                                          const CellDescription& cell) {
  if (topic == names.of(topics::commands)) return CommandTopic{CommandKind::several, cell.cell, -1};
  for (const CommandKind kind : {CommandKind::joints, CommandKind::trajectory, CommandKind::gripper}) {
    CommandTopic found{kind, names.element_in(topic, topic_of(kind)), -1};
    if (found.name.empty()) continue;
    const auto robots = static_cast<int>(cell.robots.size());
    if (kind != CommandKind::gripper) {
      found.target = cell.find_robot(found.name);
    } else if (const int gripper = cell.find_gripper(found.name); gripper >= 0) {
      found.target = robots + gripper;
    } else {
      found.kind = CommandKind::device;
      if (const int device = cell.find_device(found.name); device >= 0)
        found.target = robots + static_cast<int>(cell.grippers.size()) + device;
    }
    return found;
  }
  return std::nullopt;
}

std::optional<DiagnosticEvent> diagnose_writer(const CommandTopic& command, const std::string& topic,
                                               const std::string& type, const std::string& sender,
                                               const CellDescription& cell) {
  const auto event = [&](const auto& known) { return diagnostic(known, cell.cell, sender); };
  if (command.target < 0 && command.kind == CommandKind::device) {
    const std::string grippers = list_names(cell.grippers), devices = list_names(cell.devices);
    if (type == topic_of(CommandKind::device).type->dds_type)
      return event(events::UnknownDevice{command.name, topic, grippers, devices});
    return event(events::UnknownGripper{command.name, topic, grippers, devices});
  }
  if (command.target < 0 && command.kind != CommandKind::several)
    return event(events::UnknownRobot{command.name, topic, list_names(cell.robots)});
  if (type == topic_of(command.kind).type->dds_type) return std::nullopt;
  return event(events::WrongType{command.name, topic, ros_name(type),
                                 ros_name(topic_of(command.kind).type->dds_type)});
}

}  // namespace takt
