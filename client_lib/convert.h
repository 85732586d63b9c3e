#pragma once
// From the types on the wire to the plain structs of cell.h, and stamps. What does not fit the description (a
// count, an index) is refused here, so that no caller need check indices.
#include <optional>

#include "client_lib/cell.h"
#include "ros2_msgs.h"
#include "takt_msgs.h"

namespace takt::client {

CellInfo from_wire(const takt_msgs::msg::CellDescription& wire);
Event from_wire(const takt_msgs::msg::Event& wire);
Status from_wire(const takt_msgs::msg::Status& wire);
Power from_wire(const takt_msgs::msg::Power& wire);
/// Nothing when the sample does not belong to this description.
std::optional<Contacts> from_wire(const takt_msgs::msg::Contacts& wire, const CellInfo& cell);
/// Nothing when the sample does not belong to this description.
std::optional<State> from_wire(const takt_msgs::msg::CellState& wire, std::shared_ptr<const CellInfo> cell);

}  // namespace takt::client
