// takt watch, events and record: following a cell.
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "client_lib/recording/json_text.h"
#include "client_lib/tools/takt/commands.h"

namespace takt::tool {
namespace {

using client::Seconds;

/// A person ends what follows a cell.
constexpr double kForever_s = 1.0e9;
/// How often a server sends its status.
constexpr Seconds kStatusInterval{0.1};

/// "C:Gripper2 O:- P:O": who holds each Part.
std::string partners(const client::State& state) {
  std::string text;
  for (const auto& component : state.cell->components) {
    if (component.type != client::ComponentType::part) continue;
    const std::string partner = state.partner_of(component.name);
    text += (text.empty() ? "" : "  ") + component.name + ":" + (partner.empty() ? "-" : partner);
  }
  return text;
}

/// A line longer than the terminal is wide would not be overwritten by the next one.
std::string cut_to_terminal(std::string line) {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 && line.size() >= size.ws_col)
    line.resize(size.ws_col - 1U);
  return line;
}

std::string live_line(const client::State& state, const client::Status& status) {
  char head[160];
  std::snprintf(head, sizeof(head), "%9.3f s  %-7s %-8s RTF %-6.2f compute %.4f ", state.time_s,
                std::string(to_string(status.state)).c_str(), status.pace.c_str(), status.real_time_factor,
                status.computation_ratio);
  std::string line = head + partners(state);
  for (const auto& name : status.waiting_for) line += "  waiting for " + name;
  if (!status.fault.empty()) line += "  FAULT: " + status.fault;
  return line;
}

struct Colour {
  const char *begin = "", *end = "";
};
/// On a terminal only, and not where NO_COLOR asks for none (no-color.org).
Colour colour_of(client::Severity severity) {
  const char* none = std::getenv("NO_COLOR");
  if (isatty(STDOUT_FILENO) == 0 || (none != nullptr && *none != '\0')) return {};
  if (severity == client::Severity::error) return {"\033[1;31m", "\033[0m"};
  if (severity == client::Severity::warning) return {"\033[33m", "\033[0m"};
  return {};
}

/// What is worth a new line when it changes.
std::string summary(const client::State& state, const client::Status& status) {
  return partners(state) + std::string(to_string(status.state)) + status.pace + std::to_string(state.epoch) +
         status.fault;
}

nlohmann::json json_of(const client::State& state, const client::Status& status) {
  nlohmann::json document{{"time", state.time_s},
                          {"state", to_string(status.state)},
                          {"pace", status.pace},
                          {"computation_ratio", status.computation_ratio},
                          {"real_time_factor", status.real_time_factor},
                          {"waiting_for", status.waiting_for},
                          {"fault", status.fault}};
  for (const auto& component : state.cell->components)
    if (component.type == client::ComponentType::part)
      document["partners"][component.name] = state.partner_of(component.name);
  return document;
}

void csv_header(std::FILE* file, const client::CellInfo& info) {
  std::fprintf(file, "time");
  for (const auto& component : info.components)
    for (const char* column : {"x", "y", "z", "qx", "qy", "qz", "qw", "partner"})
      std::fprintf(file, ",%s.%s", component.name.c_str(), column);
  for (const auto& robot : info.robots)
    for (const auto& joint : robot.joints)
      std::fprintf(file, ",%s.%s", robot.name.c_str(), joint.name.c_str());
  for (const auto& gripper : info.grippers) std::fprintf(file, ",%s.width", gripper.name.c_str());
  for (const auto& device : info.devices)
    for (const auto& signal : device.signals)
      std::fprintf(file, ",%s.%s", device.name.c_str(), signal.name.c_str());
  std::fprintf(file, "\n");
}

void csv_row(std::FILE* file, const client::State& state) {
  std::fprintf(file, "%.9g", state.time_s);
  for (std::size_t i = 0; i < state.components.size(); ++i) {
    const auto& c = state.components[i];
    // 17 digits: what is read back is the number that was simulated.
    std::fprintf(file, ",%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%s", c.position_m.x, c.position_m.y,
                 c.position_m.z, c.orientation.x, c.orientation.y, c.orientation.z, c.orientation.w,
                 state.partner_of(state.cell->components[i].name).c_str());
  }
  for (const auto& robot : state.robots)
    for (const double q : robot.position) std::fprintf(file, ",%.17g", q);
  for (const auto& gripper : state.grippers) std::fprintf(file, ",%.17g", gripper.width_m);
  for (const auto& signals : state.devices)
    for (const double value : signals) std::fprintf(file, ",%.17g", value);
  std::fprintf(file, "\n");
}

}  // namespace

namespace {

/// Follows one server; an exit code, or nothing when it has gone and is to be waited for.
std::optional<int> watch_one(const Common& common, const WatchOptions& options,
                             std::optional<Session>& session) {
  const Client& cell = **session;
  const bool live = isatty(STDOUT_FILENO) != 0 && !common.json;
  std::string shown;
  const auto reached = [&](const client::State& s) {
    return options.until_s && s.time_s >= *options.until_s - 1e-9;
  };
  for (std::uint64_t seen = 0;;) {
    if (cell.cell()->scenario.empty()) {
      std::printf(
          "%s%s\n", live ? "\r\033[K" : "",
          common.json
              ? recording::json_text(nlohmann::json{{"state", to_string(cell.status().state)}}).c_str()
              : "no scenario");
      if (std::fflush(stdout) != 0) return kFailed;
      (void)cell.wait_for_status([&](const auto&) { return !cell.cell()->scenario.empty(); },
                                 Seconds{kForever_s});
      shown.clear();
      continue;
    }
    // On a terminal the line is renewed with every status; elsewhere there is one line for each change, which
    // shows in a state first (those repeat while the cell stands still, so that a pause shows too).
    std::optional<client::State> state;
    if (live) {
      const auto next =
          cell.wait_for_status([&](const auto& s) { return s.sample_number > seen; }, Seconds{kForever_s});
      if (next) seen = next->sample_number;
    } else {
      state =
          cell.wait_for_state([&](const auto& s) { return reached(s) || summary(s, cell.status()) != shown; },
                              kStatusInterval * 5);
    }
    const client::Status status = cell.status();
    if (!state) state = cell.wait_for_state([](const auto&) { return true; }, kStatusInterval * 5);
    if (!state) continue;  // it was unloaded meanwhile, or has just been loaded
    const bool over =
        reached(*state) || status.state == client::SimulationState::quitting || !status.fault.empty();
    const std::string what = summary(*state, status);
    if (live)
      std::printf("\r\033[K%s%s", cut_to_terminal(live_line(*state, status)).c_str(), over ? "\n" : "");
    else if (over || what != shown)
      std::printf("%s\n", common.json ? recording::json_text(json_of(*state, status)).c_str()
                                      : live_line(*state, status).c_str());
    if (std::fflush(stdout) != 0) return kFailed;
    shown = what;
    if (over && !options.until_s && status.fault.empty()) return {};
    if (over) return reached(*state) || (!options.until_s && status.fault.empty()) ? 0 : 1;
  }
}

/// Calls follow() with a cell until it gives an exit code. When the server goes away, that of a bounded run
/// is as told by the error; else it is waited for.
template <typename Follow>
int follow(const Common& common, bool bounded, Follow follow_one) {
  std::optional<Session> session(std::in_place, common);
  for (;;) {
    try {
      if (const std::optional<int> code = follow_one(session)) return *code;
    } catch (const ClientError& error) {
      if (error.kind() != ClientError::Kind::lost || bounded) throw;
    }
    say_that_the_cell_has_gone();
    for (session.reset(); !session;) {
      try {
        session.emplace(common);
      } catch (const NoCell&) {  // not yet
      }
    }
  }
}

}  // namespace

int watch(const Common& common, const WatchOptions& options) {
  return follow(common, options.until_s.has_value(),
                [&](std::optional<Session>& session) { return watch_one(common, options, session); });
}

namespace {

std::optional<int> events_of(const Common& common, const EventsOptions& options, std::uint64_t& n,
                             Client& cell) {
  for (; !options.count || n < *options.count; ++n) {
    const auto event = cell.next_event(Seconds{kForever_s});
    if (!event) return 1;
    if (common.json) {
      const nlohmann::json document{{"sequence_number", event->sequence_number},
                                    {"missed_before", event->missed_before},
                                    {"time", event->time_s},
                                    {"step", event->step},
                                    {"epoch", event->epoch},
                                    {"severity", to_string(event->severity)},
                                    {"code", event->code},
                                    {"subject", event->subject},
                                    {"sender", event->sender},
                                    {"message", event->message}};
      std::printf("%s\n", recording::json_text(document).c_str());
    } else {
      if (event->missed_before > 0)
        std::printf("(%llu events were lost here)\n", static_cast<unsigned long long>(event->missed_before));
      const Colour colour = colour_of(event->severity);
      std::printf("%9.3f s  %s%-11s%s %-22s %s\n", event->time_s, colour.begin,
                  std::string(to_string(event->severity)).c_str(), colour.end, event->code.c_str(),
                  event->message.c_str());
    }
    if (std::fflush(stdout) != 0) return kFailed;
  }
  return 0;
}

}  // namespace

int events(const Common& common, const EventsOptions& options) {
  std::uint64_t n = 0;
  return follow(common, options.count.has_value(),
                [&](std::optional<Session>& session) { return events_of(common, options, n, **session); });
}

int record(const Common& common, const RecordOptions& options) {
  Session session(common);
  const Client& cell = *session;
  const auto close = [](std::FILE* f) {
    if (f != stdout) std::fclose(f);
  };
  client::State state = cell.state();
  const bool to_stdout = options.file == "-";
  const std::unique_ptr<std::FILE, decltype(close)> file(
      to_stdout ? stdout : std::fopen(options.file.c_str(), "w"), close);
  if (!file) throw std::runtime_error("The file '" + options.file + "' cannot be written.");
  const double start_s = state.time_s;
  const std::uint32_t epoch = state.epoch;
  double end_s = options.duration_s ? start_s + *options.duration_s : 1.0e300;
  if (options.until_s) end_s = std::min(end_s, *options.until_s);
  csv_header(file.get(), *state.cell);
  std::uint64_t rows = 0;
  double latest_row_s = start_s;
  int code = kOk;
  for (double k = 0.0;;) {
    csv_row(file.get(), state);
    if (std::fflush(file.get()) != 0)
      throw std::runtime_error("The file '" + options.file + "' cannot be written on.");
    latest_row_s = state.time_s;
    ++rows;
    if (state.time_s >= end_s - 1e-9) break;
    while (start_s + k * options.period_s <= state.time_s + 1e-9) k += 1.0;
    const double due_s = std::min(start_s + k * options.period_s, end_s);
    const auto next = cell.wait_for_state(
        [&](const auto& s) { return s.time_s >= due_s - 1e-9 || s.epoch != epoch || s.cell != state.cell; },
        Seconds{kForever_s});
    if (!next) return 1;
    if (next->epoch != epoch || next->cell != state.cell) {
      std::fprintf(stderr, "takt: the cell was reset or loaded anew; the recording ends before that.\n");
      if (options.until_s || options.duration_s) code = kFailed;
      break;
    }
    state = *next;
  }
  std::fprintf(stderr, "%llu rows, %.3f s to %.3f s.\n", static_cast<unsigned long long>(rows), start_s,
               latest_row_s);
  return code;
}

}  // namespace takt::tool
