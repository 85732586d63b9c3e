#pragma once
// The topics of commands, and diagnostics of writers that no reader will ever match.
#include <optional>
#include <string>

#include "server/dds/topic_names.h"
#include "server/runtime/requests/event_queue.h"
#include "server/simulation/model/cell_description.h"

namespace takt {

/// `several`: for several targets in each sample.
enum class CommandKind { joints, trajectory, gripper, device, several };

const TopicInfo& topic_of(CommandKind kind);

/// The target of a command topic.
struct CommandTopic {
  CommandKind kind = CommandKind::joints;
  std::string name;  ///< of the robot, gripper or device
  int target = -1;   ///< in the cell (target_of()); -1: the cell has no such target, or `several`
};
/// std::nullopt for a topic that has no commands of this server.
std::optional<CommandTopic> command_topic(const TopicNames& names, const std::string& topic,
                                          const CellDescription& cell);

/// An event for a writer on a topic without a reader, or with another type than the reader's; else
/// std::nullopt.
std::optional<DiagnosticEvent> diagnose_writer(const CommandTopic& command, const std::string& topic,
                                               const std::string& type, const std::string& sender,
                                               const CellDescription& cell);

}  // namespace takt
