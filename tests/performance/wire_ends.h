#pragma once
// Publishers and subscribers of bench_wire: takt's, and those of raw Fast DDS. Each runs in a process of its own until
// Shared::over.
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client_lib/client.h"
#include "idl/transport/fastdds/server_participant.h"
#include "server/dds/dds_adapter.h"
#include "server/messages/instant_messages.h"
#include "server/runtime/host/cell_host.h"
#include "server/runtime/loop/scheduling.h"
#include "tests/performance/raw_dds.h"
#include "tests/performance/wire_processes.h"
#include "tests/support/crowded_cell.h"

namespace takt::wire {

inline std::string cell_of(int number) {
  return "wire" + std::to_string(number);
}

/// A server, as takt-server is; it rests while it is not its turn.
struct Server {
  Server(const Options& options, int number, int parts, double rate_Hz, Pair* pair,
         SimulationState state = SimulationState::playing) {
    HostOptions host_options;
    host_options.cell = cell_of(number);
    host_options.loop.factor = rate_Hz * 1e-3;
    host_options.loop.state = state;
    host_options.loop.realtime_priority = options.realtime_priority;
    if (pair != nullptr)
      host_options.loop.on_instant = [pair](const Simulation& simulation) {
        pair->published_ns[simulation.step_index() % kRing].store(monotonic_now_ns());
        pair->ticks.fetch_add(1);
      };
    host.emplace(host_options);
    ParticipantOptions participant;
    participant.name = std::string(kServerParticipant) + cell_of(number);
    participant.domain = static_cast<std::uint32_t>(options.domain);
    adapter.emplace(*host, participant);
    if (parts < 0)
      host->open_empty();
    else
      host->open(test::CrowdedCell(parts, true).model());
  }
  ~Server() {
    host->stop();
    adapter->stop();
  }
  std::optional<CellHost> host;
  std::optional<DdsAdapter> adapter;
};

inline void serve(const Options& options, Shared& shared, Pair& pair, int number, int parts, double rate_Hz) {
  Server server(options, number, parts, rate_Hz, &pair);
  RunLoop& loop = *server.host->loop();
  loop.suspend();
  shared.ready.fetch_add(1);
  for (bool runs = false; !shared.over.load(); sleep_ms(2)) {
    const bool turn = pair.has_turn.load() != 0;
    if (turn == runs) continue;
    runs = turn;
    if (turn)
      loop.resume();
    else
      loop.suspend();
  }
  loop.resume();
}

/// The state of the cell, as its server publishes it.
inline takt_msgs::msg::CellState state_of(int parts) {
  Simulation simulation(test::CrowdedCell(parts, true).model());
  Snapshot snapshot = simulation.make_snapshot();
  simulation.read_snapshot(snapshot);
  takt_msgs::msg::CellState state = make_state_message(simulation.description());
  fill(state, simulation.description(), snapshot);
  return state;
}

inline std::string raw_topic(bool udp) {
  return udp ? "raw/udp" : "raw/default";
}

inline void publish_raw(const Options& options, Shared& shared, Pair& pair, int parts, double rate_Hz,
                        bool udp) {
  takt_msgs::msg::CellState state = state_of(parts);
  bench::RawNode node(static_cast<std::uint32_t>(options.domain), udp);
  auto* writer = node.writer<takt_msgs::msg::CellState>(raw_topic(udp), qos_of(TopicQos::instant));
  shared.ready.fetch_add(1);
  (void)obtain_scheduling(options.realtime_priority);
  Pacer pacer(system_monotonic_clock());
  bool runs = false;
  while (!shared.over.load()) {
    const bool turn = pair.has_turn.load() != 0;
    if (turn && !runs) pacer.anchor(1.0 / rate_Hz, 1.0);
    runs = turn;
    if (!turn) {
      sleep_ms(2);
      continue;
    }
    while (pacer.wait(1'000'000'000) == Pacer::Result::not_due) {
    }
    ++state.step;
    pair.published_ns[state.step % kRing].store(monotonic_now_ns());
    pair.ticks.fetch_add(1);
    pair.missed.store(pacer.figures().overruns);
    writer->write(&state, dds::HANDLE_NIL);
  }
}

/// Meets the same machine as the loops of the publishers do.
inline void idle_loop(const Options& options, Shared& shared) {
  (void)obtain_scheduling(options.realtime_priority);
  shared.ready.fetch_add(1);
  Pacer pacer(system_monotonic_clock());
  pacer.anchor(1e-3, 1.0);
  while (!shared.over.load()) {
    while (pacer.wait(1'000'000'000) == Pacer::Result::not_due) {
    }
    shared.idle_ticks.fetch_add(1);
    shared.idle_missed.store(pacer.figures().overruns);
  }
}

/// Notes the samples of one subscriber.
class Notes {
 public:
  Notes(Pair& pair, std::size_t subscriber) : pair_(pair), subscriber_(subscriber) {}
  void note(std::uint64_t step, std::int64_t now_ns) {
    if (std::exchange(newest_, step) == step || pair_.has_turn.load() == 0) return;
    pair_.received[subscriber_].fetch_add(1);
    if (subscriber_ != 0) return;
    const std::size_t place = pair_.count.load();
    if (place == kMostLatencies) return;
    pair_.latency_ns[place] = now_ns - pair_.published_ns[step % kRing].load();
    pair_.count.store(place + 1);
  }

 private:
  Pair& pair_;
  const std::size_t subscriber_;
  std::uint64_t newest_ = 0;
};

inline void subscribe_raw(const Options& options, Shared& shared, Pair& pair, std::size_t number,
                          const std::string& topic, bool udp) {
  Notes notes(pair, number);
  constexpr std::chrono::milliseconds kLook{50};
  bench::Newest<takt_msgs::msg::CellState> states;
  bench::RawNode node(static_cast<std::uint32_t>(options.domain), udp);
  node.reader<takt_msgs::msg::CellState>(topic, qos_of(TopicQos::instant), states);
  shared.ready.fetch_add(1);
  for (std::uint64_t count = 0; !shared.over.load();) {
    if (!states.wait_beyond(count, kLook)) continue;
    count = states.count();
    notes.note(states.look([](const auto& state) { return state.step; }), monotonic_now_ns());
  }
}

inline ClientOptions client_options(const Options& options, int cell) {
  ClientOptions client;
  client.cell = cell_of(cell);
  client.domain = options.domain;
  client.timeout = Seconds{60.0};
  return client;
}

inline void subscribe(const Options& options, Shared& shared, Pair& pair, std::size_t number, int cell) {
  Notes notes(pair, number);
  const Client client(client_options(options, cell));
  shared.ready.fetch_add(1);
  while (!shared.over.load()) {
    if (number == 0) pair.missed.store(client.status().overruns);
    (void)client.wait_for(
        topics::state,
        [&](const State& state) {
          notes.note(state.step, monotonic_now_ns());
          return false;
        },
        Seconds{0.1});
  }
}

}  // namespace takt::wire
