// takt watch and events: following a cell.
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <optional>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/sample_json.h"

namespace takt::tool {
namespace {

/// A person ends what follows a cell.
constexpr double kForever_s = 1.0e9;
/// How often a server sends its status.
constexpr Seconds kStatusInterval{0.1};

/// "C:Gripper2 O:- P:O": what holds each Part.
std::string partners(const State& state) {
  std::string text;
  for (const auto& component : state.cell->components) {
    if (component.type != ComponentType::part) continue;
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

std::string live_line(const State& state, const Status& status) {
  char head[160];
  std::snprintf(head, sizeof(head), "%9.3f s  %-7s %-8s real-time factor %-6.2f computation ratio %.4f ",
                state.time, std::string(to_string(status.state)).c_str(),
                std::string(to_string(status.pace)).c_str(), status.real_time_factor,
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
Colour colour_of(Severity severity) {
  const char* none = std::getenv("NO_COLOR");
  if (isatty(STDOUT_FILENO) == 0 || (none != nullptr && *none != '\0')) return {};
  if (severity == Severity::error) return {"\033[1;31m", "\033[0m"};
  if (severity == Severity::warning) return {"\033[33m", "\033[0m"};
  return {};
}

/// A change of this text begins a new line.
std::string summary(const State& state, const Status& status) {
  return partners(state) + std::string(to_string(status.state)) + std::string(to_string(status.pace)) +
         std::to_string(state.epoch) + status.fault;
}

/// The status, and the holder of each Part.
nlohmann::json watched(const State& state, const Status& status) {
  auto document = json_of(status);
  for (std::size_t i = 0; i < state.components.size(); ++i) {
    if (state.cell->components[i].type != ComponentType::part) continue;
    const std::string partner = state.cell->component_name(state.components[i].partner);
    document["partners"][state.cell->components[i].name] =
        partner.empty() ? nlohmann::json() : nlohmann::json(partner);
  }
  return document;
}

/// Follows one server; an exit code, or nothing when it has gone and is to be waited for.
std::optional<int> watch_one(const Common& common, const WatchOptions& options,
                             std::optional<Session>& session) {
  const Client& cell = **session;
  const bool live = isatty(STDOUT_FILENO) != 0 && !common.json;
  std::string shown;
  const auto reached = [&](const State& s) { return options.until_s && s.time >= *options.until_s - 1e-9; };
  for (std::uint64_t seen = 0;;) {
    if (cell.cell()->scenario.empty()) {
      std::printf(
          "%s%s\n", live ? "\r\033[K" : "",
          common.json
              ? recording::json_text(nlohmann::json{{"state", to_string(cell.status().state)}}).c_str()
              : "no scenario");
      if (std::fflush(stdout) != 0) return kFailed;
      (void)cell.wait_for(
          topics::status, [&](const auto&) { return !cell.cell()->scenario.empty(); }, Seconds{kForever_s});
      shown.clear();
      continue;
    }
    // On a terminal the line is renewed with every status; elsewhere there is one line for each change, which
    // shows in a state first (those repeat while the cell stands still, so that a pause shows too).
    std::optional<State> state;
    if (live) {
      const auto next = cell.wait_for(
          topics::status, [&](const auto& s) { return s.sample_number > seen; }, Seconds{kForever_s});
      if (next) seen = next->sample_number;
    } else {
      state = cell.wait_for(
          topics::state, [&](const auto& s) { return reached(s) || summary(s, cell.status()) != shown; },
          kStatusInterval * 5);
    }
    const Status status = cell.status();
    if (!state) state = cell.wait_for(topics::state, kStatusInterval * 5);
    if (!state) continue;  // it was unloaded meanwhile, or has just been loaded
    const bool over = reached(*state) || status.state == SimulationState::quitting || !status.fault.empty();
    const std::string what = summary(*state, status);
    if (live)
      std::printf("\r\033[K%s%s", cut_to_terminal(live_line(*state, status)).c_str(), over ? "\n" : "");
    else if (over || what != shown)
      std::printf("%s\n", common.json ? recording::json_text(watched(*state, status)).c_str()
                                      : live_line(*state, status).c_str());
    if (std::fflush(stdout) != 0) return kFailed;
    shown = what;
    if (over && !options.until_s && status.fault.empty()) return {};
    if (over) return reached(*state) || (!options.until_s && status.fault.empty()) ? 0 : 1;
  }
}

/// Calls follow_one() with a session until it returns an exit code. When the server goes away, a bounded run
/// ends with the error; an unbounded run waits for the next server.
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
    const auto event = cell.wait_for(topics::event, Seconds{kForever_s});
    if (!event) return 1;
    if (common.json) {
      print_json(json_of(*event));
    } else {
      if (event->missed_before > 0)
        std::printf("(%llu events were lost here)\n", static_cast<unsigned long long>(event->missed_before));
      const Colour colour = colour_of(event->severity);
      std::printf("%9.3f s  %s%-11s%s %-22s %s\n", event->time, colour.begin,
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

}  // namespace takt::tool
