#pragma once
// The topics that commands come in by, and what is wrong with a writer that no reader will ever match.
#include <optional>
#include <string>

#include "server/dds/topic_names.h"
#include "server/runtime/requests/event_queue.h"
#include "server/simulation/model/cell_description.h"

namespace takt {

enum class CommandKind { joints, trajectory, gripper, device };

const TopicInfo& topic_of(CommandKind kind);

/// What a command topic is for.
struct CommandTopic {
  CommandKind kind = CommandKind::joints;
  std::string name;  ///< of the robot, gripper or device
  int target = -1;   ///< in the cell (target_of()); -1: the cell has none of this kind and name
};
/// Nothing for a topic that is not for commands of this server.
std::optional<CommandTopic> command_topic(const TopicNames& names, const std::string& topic,
                                          const CellDescription& cell);

/// A writer on a topic without a reader, or of another type than the reader's: an event says so.
std::optional<DiagnosticEvent> diagnose_writer(const CommandTopic& command, const std::string& topic,
                                               const std::string& type, const std::string& sender,
                                               const CellDescription& cell);

}  // namespace takt
