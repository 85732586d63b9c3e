#pragma once
// Samples of a client as JSON (client_lib/recording/message_json.h).
#include "client_lib/cell.h"
#include "client_lib/recording/message_json.h"

namespace takt::tool {

template <Message Type>
nlohmann::json json_of(const Sample<Type>& sample) {
  return recording::message_json<Type>(sample, sample.cell->lists);
}
inline nlohmann::json json_of(const CellInfo& description) {
  return recording::message_json<takt_msgs::msg::CellDescription>(description, description.lists);
}
inline nlohmann::json json_of(const Event& event) {
  auto document = recording::message_json<takt_msgs::msg::Event>(event, event.cell->lists);
  document["missed_before"] = event.missed_before;
  return document;
}

}  // namespace takt::tool
