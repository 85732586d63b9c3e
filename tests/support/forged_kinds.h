#pragma once
// What a stranger may send in the name of a cell's server, one packet of each kind.
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "tests/support/foreign_sender.h"
#include "tests/support/writer_spy.h"

namespace takt::test {

/// The number ahead of `reason` in "3 source, 1 locator".
inline std::uint64_t dropped_for(const std::string& reason, const std::string& summary) {
  const auto at = summary.find(" " + reason);
  if (at == std::string::npos) return 0;
  const auto begin = summary.find_last_of(' ', at - 1);
  return std::stoull(summary.substr(begin == std::string::npos ? 0 : begin + 1));
}

template <Message Type>
std::string bytes_of(const Type& message) {
  std::string bytes;
  cdr::write(message, bytes);
  return bytes;
}

/// The writers of the server, and what a stranger makes of them.
struct Victim {
  Victim(WriterSpy& spy, const std::string& cell)
      : state(entity_of(spy.writer_of(cell + "/state"))),
        status(entity_of(spy.writer_of(cell + "/status"))),
        events(entity_of(spy.writer_of(cell + "/events"))),
        description(entity_of(spy.writer_of(cell + "/description"))),
        reply(entity_of(spy.writer_of(cell + "/control/reply"))),
        forgery(prefix_of(spy.writer_of(cell + "/state"))) {}
  /// Of a writer that does not exist.
  PacketBytes harmless() const { return forgery.heartbeat(0x00ff0103, 1, 1); }
  std::uint32_t state, status, events, description, reply;
  Forgery forgery;
};

struct ForgedKind {
  std::string name;
  std::function<PacketBytes(const Victim&, const State& newest)> make;
};

inline constexpr std::int64_t kFarNumber = 1'000'000;

template <typename Change>
ForgedKind forged_state(const std::string& name, Change change, std::int64_t number = kFarNumber) {
  return {name, [change, number](const Victim& victim, const State& newest) {
            takt_msgs::msg::CellState state = newest;
            change(state);
            return victim.forgery.sample(victim.state, number, bytes_of(state));
          }};
}

inline std::vector<ForgedKind> forged_kinds() {
  using takt_msgs::msg::CellState;
  return {
      {"participant_ends", [](const Victim& v, const State&) { return v.forgery.participant_ends(); }},
      {"state_writer_ends", [](const Victim& v, const State&) { return v.forgery.writer_ends(v.state); }},
      {"status_writer_ends", [](const Victim& v, const State&) { return v.forgery.writer_ends(v.status); }},
      {"description_writer_ends",
       [](const Victim& v, const State&) { return v.forgery.writer_ends(v.description); }},
      {"announced_elsewhere", [](const Victim& v, const State&) { return v.forgery.announcement(20, 1000); }},
      forged_state("epoch_ahead", [](CellState& s) { s.epoch = 4'000'000'000; }),
      forged_state("scenario_ahead", [](CellState& s) { s.scenario_generation = 4'000'000'000; }),
      forged_state("step_ahead", [](CellState& s) { s.step = std::uint64_t{1} << 60U; }),
      forged_state("time_ahead", [](CellState& s) { s.time = 1e9, ++s.step; }),
      forged_state(
          "number_ahead", [](CellState&) {}, std::int64_t{1} << 26U),
      {"status_ahead",
       [](const Victim& v, const State&) {
         takt_msgs::msg::Status status;
         status.epoch = 4'000'000'000;
         return v.forgery.sample(v.status, kFarNumber, bytes_of(status));
       }},
      {"event_ahead",
       [](const Victim& v, const State&) {
         takt_msgs::msg::Event event;
         event.sequence_number = std::uint64_t{1} << 60U;
         return v.forgery.sample(v.events, kFarNumber, bytes_of(event));
       }},
      {"description_of_another_scenario",
       [](const Victim& v, const State& s) {
         takt_msgs::msg::CellDescription description;
         description.cell = s.cell->cell;
         description.scenario_generation = s.scenario_generation + 1000;
         return v.forgery.sample(v.description, kFarNumber, bytes_of(description));
       }},
      {"heartbeat_of_events",
       [](const Victim& v, const State&) {
         return v.forgery.heartbeat(v.events, kFarNumber, kFarNumber + 10);
       }},
      {"heartbeat_of_endpoints",
       [](const Victim& v, const State&) { return v.forgery.heartbeat(kSedpWriter, 1000, 1000); }},
      {"gap_of_events", [](const Victim& v, const State&) { return v.forgery.gap(v.events, 1, 10'000); }},
      {"gap_of_replies", [](const Victim& v, const State&) { return v.forgery.gap(v.reply, 1, 10'000); }},
      {"gap_of_endpoints",
       [](const Victim& v, const State&) { return v.forgery.gap(kSedpWriter, 1, 10'000); }},
      {"acknowledgement_of_requests",
       [](const Victim& v, const State&) {
         return v.forgery.acknowledgement(0x00000104, 0x00000103, kFarNumber);
       }},
  };
}

}  // namespace takt::test
