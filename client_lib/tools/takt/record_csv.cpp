// takt record FILE.csv: states as a table, a column for each value, named as signals of recordings are.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "client_lib/recording/signal_table.h"
#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/instant_watch.h"
#include "client_lib/tools/takt/sample_json.h"

namespace takt::tool {
int record_csv(const Common& common, const RecordOptions& options) {
  Session session(common);
  Client& cell = *session;
  const auto close = [](std::FILE* f) {
    if (f != stdout) std::fclose(f);
  };
  State state = cell.state();
  const std::unique_ptr<std::FILE, decltype(close)> file(
      options.file == "-" ? stdout : std::fopen(options.file.c_str(), "w"), close);
  if (!file) throw std::runtime_error("The file '" + options.file + "' cannot be written.");
  const double start_s = state.time;
  const std::uint32_t epoch = state.epoch;
  double end_s = options.duration_s ? start_s + *options.duration_s : 1.0e300;
  if (options.until_s) end_s = std::min(end_s, *options.until_s);
  InstantWatch watch(Seconds{options.period_s}, Seconds{start_s});
  watch.renew(cell);
  recording::SignalTable table;
  std::uint64_t rows = 0;
  double latest_row_s = start_s;
  const bool bounded = options.until_s || options.duration_s;
  int code = kOk;
  for (double k = 0.0;;) {
    auto instant = json_of(state);
    for (const char* other : {"stamp", "applied", "scenario_generation"}) instant.erase(other);
    std::fputs(table.lines(instant).c_str(), file.get());
    if (std::fflush(file.get()) != 0)
      throw std::runtime_error("The file '" + options.file + "' cannot be written on.");
    latest_row_s = state.time;
    ++rows;
    if (state.time >= end_s - 1e-9) break;
    while (start_s + k * options.period_s <= state.time + 1e-9) k += 1.0;
    const double due_s = std::min(start_s + k * options.period_s, end_s);
    std::optional<State> next;
    while (!next) {
      try {
        watch.renew(cell);
        next = cell.wait_for(
            topics::state,
            [&](const auto& s) { return s.time >= due_s - 1e-9 || s.epoch != epoch || s.cell != state.cell; },
            InstantWatch::kRenewal);
      } catch (const ClientError& error) {
        if (error.kind() != ClientError::Kind::lost || bounded) throw;
        say_that_the_cell_has_gone();
        while (!cell.wait_for_connection(Seconds{1.0})) continue;
      }
    }
    if (next->epoch != epoch || next->cell != state.cell) {
      std::fprintf(stderr,
                   "takt: the cell was reset or has loaded a scenario; the recording ends before that.\n");
      if (bounded) code = kFailed;
      break;
    }
    state = *next;
  }
  std::fprintf(stderr, "%llu rows, %.3f s to %.3f s.\n", static_cast<unsigned long long>(rows), start_s,
               latest_row_s);
  return code;
}

}  // namespace takt::tool
