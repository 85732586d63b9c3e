#pragma once
// Status of the loop and events as messages.
#include "server/runtime/loop/loop_output.h"
#include "server/runtime/requests/event.h"
#include "takt_msgs.h"

namespace takt {

takt_msgs::msg::Status to_message(const LoopStatus& status, const CellDescription& cell);
/// Sequence number and sender are the caller's to fill in.
takt_msgs::msg::Event to_message(const EventRecord& event, const CellDescription& cell);

}  // namespace takt
