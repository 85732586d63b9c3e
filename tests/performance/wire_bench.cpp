// What a cell's samples cost on the wire, beside raw Fast DDS of the same payload and QoS, in the same run:
//   latency      from the end of a step to a thread that waits for its state, in another process
//   subscribers  processor time of the server and of each subscriber, and missed ticks
//   unseen       processor time of a server without a client
//   cells        several cells of one domain, and what it takes to find them
// The sides take turns in short blocks, so that all meet the same machine, and wait when it is not their turn.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "tests/performance/wire_ends.h"

namespace takt::wire {
namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct Block {
  double p50_us = 0.0, p99_us = 0.0;
  std::uint64_t ticks = 0, received = 0, missed = 0, idle_ticks = 0, idle_missed = 0;
  double publisher_cpu = 0.0, subscriber_cpu = 0.0;  ///< shares of a core; subscriber: mean
};

/// The pair has its turn for this long.
Block run_block(Shared& shared, Pair& pair, double seconds, pid_t publisher,
                const std::vector<pid_t>& subscribers) {
  pair.has_turn.store(1);
  sleep_ms(200);  // resumed, and past the steps that were due meanwhile
  const std::uint64_t ticks = pair.ticks.load(), received = pair.received[0].load(),
                      missed = pair.missed.load();
  const std::uint64_t idle_ticks = shared.idle_ticks.load(), idle_missed = shared.idle_missed.load();
  double publisher_s = -cpu_s(publisher), subscribers_s = 0.0;
  for (const pid_t subscriber : subscribers) subscribers_s -= cpu_s(subscriber);
  pair.count.store(0);
  const std::int64_t began = monotonic_now_ns();
  sleep_ms(static_cast<int>(1e3 * seconds));
  const double wall_s = 1e-9 * static_cast<double>(monotonic_now_ns() - began);
  Block block;
  const std::size_t count = pair.count.load();
  publisher_s += cpu_s(publisher);
  for (const pid_t subscriber : subscribers) subscribers_s += cpu_s(subscriber);
  block.ticks = pair.ticks.load() - ticks;
  block.received = pair.received[0].load() - received;
  block.missed = pair.missed.load() - missed;
  block.idle_ticks = shared.idle_ticks.load() - idle_ticks;
  block.idle_missed = shared.idle_missed.load() - idle_missed;
  pair.has_turn.store(0);
  std::vector<std::int64_t> latencies(pair.latency_ns.begin(),
                                      pair.latency_ns.begin() + static_cast<std::ptrdiff_t>(count));
  sleep_ms(50);
  std::sort(latencies.begin(), latencies.end());
  const auto quantile = [&](double q) {
    if (latencies.empty()) return 0.0;
    return 1e-3 * static_cast<double>(
                      latencies[static_cast<std::size_t>(q * static_cast<double>(latencies.size() - 1))]);
  };
  block.p50_us = quantile(0.5);
  block.p99_us = quantile(0.99);
  block.publisher_cpu = publisher_s / wall_s;
  if (!subscribers.empty())
    block.subscriber_cpu = subscribers_s / wall_s / static_cast<double>(subscribers.size());
  return block;
}

template <typename Value>
double median_of(const std::vector<Block>& blocks, Value value) {
  std::vector<double> values;
  for (const Block& block : blocks) values.push_back(value(block));
  return median(values);
}
template <typename Value>
double least_of(const std::vector<Block>& blocks, Value value) {
  double least = value(blocks.front());
  for (const Block& block : blocks) least = std::min(least, value(block));
  return least;
}
/// The median over the turns of the ratio to the raw pair's neighbouring block.
template <typename Value>
double ratio_of(const std::vector<Block>& blocks, const std::vector<Block>& raw, Value value) {
  std::vector<double> values;
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (value(raw[i]) > 0.0) values.push_back(value(blocks[i]) / value(raw[i]));
  return median(values);
}

void measure_latency(const Options& options, Shared& shared, int parts, double rate_Hz) {
  Processes processes(shared);
  struct Row {
    const char* name;
    pid_t publisher = 0, subscriber = 0;
    std::vector<Block> blocks{};
  };
  std::array<Row, 4> rows{
      {{"raw Fast DDS"}, {"raw Fast DDS, UDP alone"}, {"takt, raw subscriber"}, {"takt"}}};
  for (std::size_t k = 0; k < rows.size(); ++k) {
    Pair& pair = shared.pairs[k];
    const int number = static_cast<int>(k);
    rows[k].publisher = processes.start([&] {
      if (k < 2)
        publish_raw(options, shared, pair, parts, rate_Hz, k == 1);
      else
        serve(options, shared, pair, number, parts, rate_Hz);
    });
  }
  processes.wait_for_ready(4);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    Pair& pair = shared.pairs[k];
    const int number = static_cast<int>(k);
    rows[k].subscriber = processes.start([&] {
      if (k < 2)
        subscribe_raw(options, shared, pair, 0, raw_topic(k == 1), k == 1);
      else if (k == 2)
        subscribe_raw(options, shared, pair, 0, "rt/" + topics::state.name(cell_of(number)), false);
      else
        subscribe(options, shared, pair, 0, number);
    });
  }
  processes.wait_for_ready(8);
  for (std::size_t k = 0; k < rows.size(); ++k)  // until samples arrive
    for (int i = 0; i < 20; ++i)
      if (run_block(shared, shared.pairs[k], 0.1, rows[k].publisher, {rows[k].subscriber}).received > 0)
        break;
  for (int repetition = 0; repetition < options.repetitions; ++repetition)
    for (std::size_t k = 0; k < rows.size(); ++k) {
      Row& row = rows[k];
      row.blocks.push_back(
          run_block(shared, shared.pairs[k], options.seconds, row.publisher, {row.subscriber}));
    }
  std::printf("%d parts, state of %zu bytes, %.0f Hz, %d turns of %.1f s\n", parts,
              cdr::size(state_of(parts)), rate_Hz, options.repetitions, options.seconds);
  std::printf("  %-24s %16s %16s %7s %7s %10s %10s %9s\n", "", "p50 us (least)", "p99 us (least)", "/ raw",
              "/ raw", "publisher", "subscriber", "received");
  const auto p50 = [](const Block& b) { return b.p50_us; };
  const auto p99 = [](const Block& b) { return b.p99_us; };
  for (const Row& row : rows) {
    std::uint64_t ticks = 0, received = 0;
    for (const Block& block : row.blocks) ticks += block.ticks, received += block.received;
    std::printf(
        "  %-24s %7.0f (%6.0f) %7.0f (%6.0f) %7.2f %7.2f %8.1f %% %8.1f %% %7.2f %%\n", row.name,
        median_of(row.blocks, p50), least_of(row.blocks, p50), median_of(row.blocks, p99),
        least_of(row.blocks, p99), ratio_of(row.blocks, rows[0].blocks, p50),
        ratio_of(row.blocks, rows[0].blocks, p99),
        100.0 * median_of(row.blocks, [](const Block& b) { return b.publisher_cpu; }),
        100.0 * median_of(row.blocks, [](const Block& b) { return b.subscriber_cpu; }),
        100.0 * static_cast<double>(received) / static_cast<double>(std::max<std::uint64_t>(ticks, 1)));
  }
  std::fflush(stdout);
}

void measure_subscribers(const Options& options, Shared& shared, int parts) {
  Processes processes(shared);
  struct Row {
    const char* name;
    pid_t publisher = 0;
    std::vector<pid_t> subscribers{};
  };
  std::array<Row, 2> rows{{{"raw Fast DDS"}, {"takt"}}};
  // A domain for each: its participants do not listen to the others.
  const auto of = [&](std::size_t k) {
    Options own = options;
    own.domain += static_cast<int>(k);
    return own;
  };
  const auto idle = [&] { idle_loop(options, shared); };
  (void)processes.start(idle);
  int ready = 1;
  for (std::size_t k = 0; k < rows.size(); ++k, ++ready)
    rows[k].publisher = processes.start([&] {
      if (k == 0)
        publish_raw(of(k), shared, shared.pairs[k], parts, 1000.0, false);
      else
        serve(of(k), shared, shared.pairs[k], 1, parts, 1000.0);
    });
  processes.wait_for_ready(ready);
  std::printf(
      "%d parts, 1 kHz; shares of a core; ticks missed per 1000 beside those of an idle loop (priority %d)\n",
      parts, options.realtime_priority);
  std::printf("  %-14s %12s %10s %12s %12s %9s %9s %10s\n", "", "subscribers", "publisher", "per one",
              "subscriber", "missed", "idle loop", "received");
  for (const int count : options.subscribers) {
    for (std::size_t k = 0; k < rows.size(); ++k)
      for (Row& row = rows[k]; static_cast<int>(row.subscribers.size()) < count; ++ready) {
        const std::size_t number = row.subscribers.size();
        row.subscribers.push_back(processes.start([&] {
          if (k == 0)
            subscribe_raw(of(k), shared, shared.pairs[k], number, raw_topic(false), false);
          else
            subscribe(of(k), shared, shared.pairs[k], number, 1);
        }));
        processes.wait_for_ready(ready + 1);
      }
    sleep_ms(1000);  // until all have found each other
    std::array<std::vector<Block>, 2> blocks;
    for (int repetition = 0; repetition < options.repetitions; ++repetition)
      for (std::size_t k = 0; k < rows.size(); ++k)
        blocks[k].push_back(
            run_block(shared, shared.pairs[k], options.seconds, rows[k].publisher, rows[k].subscribers));
    for (std::size_t k = 0; k < rows.size(); ++k) {
      Block sum;
      for (const Block& block : blocks[k]) {
        sum.ticks += block.ticks, sum.received += block.received, sum.missed += block.missed;
        sum.idle_ticks += block.idle_ticks, sum.idle_missed += block.idle_missed;
      }
      const auto per_1000 = [](std::uint64_t some, std::uint64_t all) {
        return 1e3 * static_cast<double>(some) / static_cast<double>(std::max<std::uint64_t>(all, 1));
      };
      const double publisher = 100.0 * median_of(blocks[k], [](const Block& b) { return b.publisher_cpu; });
      std::printf("  %-14s %12d %8.1f %% %10.2f %% %10.1f %% %9.2f %9.2f %8.1f %%\n", rows[k].name, count,
                  publisher, publisher / count,
                  100.0 * median_of(blocks[k], [](const Block& b) { return b.subscriber_cpu; }),
                  per_1000(sum.missed, sum.ticks), per_1000(sum.idle_missed, sum.idle_ticks),
                  0.1 * per_1000(sum.received, sum.ticks));
    }
    std::fflush(stdout);
  }
}

/// A server without a client.
double cpu_of_unseen_server(const Options& options, Shared& shared, int parts, SimulationState state,
                            double factor) {
  Processes processes(shared);
  const pid_t server = processes.start([&] {
    const Server served(options, 0, parts, factor * 1000.0, nullptr, state);
    shared.ready.fetch_add(1);
    while (!shared.over.load()) sleep_ms(100);
  });
  processes.wait_for_ready(1);
  sleep_ms(2500);  // past the announcements of the start
  std::vector<double> shares;
  for (int i = 0; i < options.repetitions; ++i) {
    const std::int64_t began = monotonic_now_ns();
    const double before = cpu_s(server);
    sleep_ms(static_cast<int>(1e3 * options.seconds));
    shares.push_back((cpu_s(server) - before) / (1e-9 * static_cast<double>(monotonic_now_ns() - began)));
  }
  return median(shares);
}

void measure_unseen(const Options& options, Shared& shared) {
  std::printf(
      "processor time of a server without a client, %% of a core (the wait of 10 times a second of this "
      "benchmark "
      "included)\n");
  const auto print = [&](const char* name, int parts, SimulationState state, double factor) {
    std::printf("  %-34s %6.2f\n", name, 100.0 * cpu_of_unseen_server(options, shared, parts, state, factor));
    std::fflush(stdout);
  };
  {
    Processes processes(shared);
    const pid_t loop = processes.start([&] { idle_loop(options, shared); });
    processes.wait_for_ready(1);
    const double before = cpu_s(loop);
    sleep_ms(static_cast<int>(1e3 * options.seconds * options.repetitions));
    std::printf("  %-34s %6.2f\n", "for comparison: an empty loop, 1 kHz",
                100.0 * (cpu_s(loop) - before) / (options.seconds * options.repetitions));
  }
  print("no scenario", -1, SimulationState::paused, 1.0);
  print("paused", 10, SimulationState::paused, 1.0);
  print("playing, 125 Hz, 10 parts", 10, SimulationState::playing, 0.125);
  print("playing, 1 kHz, 10 parts", 10, SimulationState::playing, 1.0);
  print("playing, 1 kHz, 1000 parts", 1000, SimulationState::playing, 1.0);
}

void measure_cells(const Options& options, Shared& shared) {
  std::printf("cells of one domain, each playing at 1 kHz\n");
  std::printf("  %6s %22s %14s %16s %12s\n", "cells", "CPU of each, % of a core", "to connect", "to list",
              "listed");
  for (const int count : options.cells) {
    Processes processes(shared);
    std::vector<pid_t> servers;
    for (int cell = 0; cell < count; ++cell)
      servers.push_back(processes.start([&] {
        const Server served(options, cell, 10, 1000.0, nullptr);
        shared.ready.fetch_add(1);
        while (!shared.over.load()) sleep_ms(100);
      }));
    processes.wait_for_ready(count);
    sleep_ms(2500);
    std::vector<double> shares, connects_ms, lists_ms;
    int listed = count;
    for (int i = 0; i < options.repetitions; ++i) {
      double used = 0.0;
      for (const pid_t server : servers) used -= cpu_s(server);
      const std::int64_t began = monotonic_now_ns();
      sleep_ms(static_cast<int>(1e3 * options.seconds));
      for (const pid_t server : servers) used += cpu_s(server);
      shares.push_back(100.0 * used / (1e-9 * static_cast<double>(monotonic_now_ns() - began)) / count);
      const auto visit = [&](const std::function<void()>& work, std::atomic<int>& time_us) {
        const pid_t visitor = processes.start([&] {
          const std::int64_t start = monotonic_now_ns();
          work();
          time_us.store(static_cast<int>((monotonic_now_ns() - start) / 1000));
        });
        waitpid(visitor, nullptr, 0);
        return 1e-3 * time_us.load();
      };
      connects_ms.push_back(
          visit([&] { const Client client(client_options(options, i % count)); }, shared.connected_us));
      lists_ms.push_back(visit(
          [&] {
            const auto cells = list_cells(options.domain, Seconds{5.0});
            shared.listed.store(static_cast<int>(cells.size()));
          },
          shared.listed_us));
      listed = std::min(listed, shared.listed.load());
    }
    std::printf("  %6d %22.2f %11.0f ms %13.0f ms %7d of %d\n", count, median(shares), median(connects_ms),
                median(lists_ms), listed, count);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace takt::wire

int main(int argc, char** argv) {
  takt::wire::Options options;
  options.domain = 100 + static_cast<int>(getpid()) % 100;
  CLI::App app("The samples of a cell beside raw Fast DDS; without a subcommand all measurements.");
  app.add_option("--domain", options.domain, "DDS domain; the next one is used too");
  app.add_option("--parts", options.parts, "Parts of the cell")->capture_default_str();
  app.add_option("--rates", options.rates_Hz, "states per second")->capture_default_str();
  app.add_option("--subscribers", options.subscribers, "numbers of subscribers, increasing")
      ->capture_default_str();
  app.add_option("--cells", options.cells, "numbers of cells")->capture_default_str();
  app.add_option("--repetitions", options.repetitions, "turns of each side")->capture_default_str();
  app.add_option("--seconds", options.seconds, "length of a turn")->capture_default_str();
  app.add_option("--realtime-priority", options.realtime_priority, "of the loops");
  auto* latency = app.add_subcommand("latency", "from the end of a step to a waiting thread of a subscriber");
  auto* subscribers =
      app.add_subcommand("subscribers", "processor time and missed ticks by number of subscribers");
  auto* unseen = app.add_subcommand("unseen", "processor time of a server without a client");
  auto* cells = app.add_subcommand("cells", "several cells of one domain");
  CLI11_PARSE(app, argc, argv);
  takt::wire::Shared& shared = *takt::wire::make_shared_memory();
  const bool all = app.get_subcommands().empty();
  if (all || latency->parsed())
    for (const int parts : options.parts)
      for (const double rate_Hz : options.rates_Hz)
        takt::wire::measure_latency(options, shared, parts, rate_Hz);
  if (all || subscribers->parsed()) takt::wire::measure_subscribers(options, shared, options.parts.front());
  if (all || unseen->parsed()) takt::wire::measure_unseen(options, shared);
  if (all || cells->parsed()) takt::wire::measure_cells(options, shared);
  return 0;
}
