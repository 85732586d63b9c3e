#pragma once
// Samples of a client as JSON (client_lib/recording/message_json.h).
#include "client_lib/cell.h"
#include "client_lib/recording/message_json.h"

namespace takt::tool {

inline nlohmann::json json_of(const State& state) {
  return recording::message_json<takt_msgs::msg::CellState>(state, state.cell->lists);
}
inline nlohmann::json json_of(const Contacts& contacts) {
  return recording::message_json<takt_msgs::msg::Contacts>(contacts, contacts.cell->lists);
}
inline nlohmann::json json_of(const Power& power) {
  return recording::message_json<takt_msgs::msg::Power>(power, {});
}
inline nlohmann::json json_of(const Status& status) {
  return recording::message_json<takt_msgs::msg::Status>(status, {});
}
inline nlohmann::json json_of(const Event& event) {
  auto document = recording::message_json<takt_msgs::msg::Event>(event, {});
  document["missed_before"] = event.missed_before;
  return document;
}

}  // namespace takt::tool
