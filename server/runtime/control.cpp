#include "server/runtime/control.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <string_view>

namespace takt {
namespace {

/// Reads the arguments of one request; the first thing wrong is kept as a sentence.
class Arguments {
 public:
  Arguments(const ControlRequest& request, std::initializer_list<std::string_view> allowed)
      : request_(request) {
    std::string list;
    for (const auto name : allowed) list += (list.empty() ? "" : ", ") + std::string(name);
    for (std::size_t i = 0; i < request.arguments.size(); ++i) {
      const std::string& name = request.arguments[i].first;
      if (std::find(allowed.begin(), allowed.end(), name) == allowed.end()) {
        fail("has no argument '" + name + "'; it takes " + (list.empty() ? "none" : list) + ".");
      }
      for (std::size_t j = 0; j < i; ++j) {
        if (request.arguments[j].first == name) fail("has the argument '" + name + "' twice.");
      }
    }
  }

  const std::string* find(std::string_view name) const {
    for (const auto& [key, value] : request_.arguments) {
      if (key == name) return &value;
    }
    return nullptr;
  }

  std::string text(std::string_view name, std::string_view what) {
    const std::string* value = find(name);
    if (value == nullptr || value->empty())
      fail("needs the argument '" + std::string(name) + "': " + std::string(what));
    return value == nullptr ? std::string() : *value;
  }

  double real(std::string_view name, std::optional<double> fallback, double low, double high) {
    const std::string* value = find(name);
    if (value == nullptr && fallback) return *fallback;
    double number = 0.0;
    if (value != nullptr && read(*value, number) && number >= low && number <= high) return number;
    fail_value(name, value, "a number from " + exact_text(low) + " to " + exact_text(high));
    return low;
  }

  std::uint64_t natural(std::string_view name, std::optional<std::uint64_t> fallback, std::uint64_t low,
                        std::uint64_t high) {
    const std::string* value = find(name);
    if (value == nullptr && fallback) return *fallback;
    std::uint64_t number = 0;
    if (value != nullptr && read(*value, number) && number >= low && number <= high) return number;
    fail_value(name, value, "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    return low;
  }

  void fail_value(std::string_view name, const std::string* value, const std::string& allowed) {
    const std::string found = value == nullptr ? "missing" : "'" + value->substr(0, 100) + "'";
    fail("argument '" + std::string(name) + "' is " + found + "; allowed is " + allowed + ".");
  }
  void fail(const std::string& what) {
    if (!error_) error_ = "Request '" + request_.request + "' " + what;
  }

  /// The action, or the reply that says what was wrong with the arguments.
  std::variant<ControlAction, ControlReply> result(ControlAction action) const {
    if (error_) return ControlReply{request_.id, ControlResult::failed, *error_, {}};
    return action;
  }

 private:
  template <typename Number>
  static bool read(const std::string& text, Number& number) {
    const char* end = text.data() + text.size();
    const auto [last, error] = std::from_chars(text.data(), end, number);
    return error == std::errc() && last == end;
  }

  const ControlRequest& request_;
  std::optional<std::string> error_;
};

std::vector<int> read_targets(Arguments& arguments, const CellDescription& cell) {
  const std::string list = arguments.text("targets", "robots and grippers, separated by commas.");
  std::vector<int> targets;
  std::size_t begin = 0;
  while (begin <= list.size() && !list.empty()) {
    const std::size_t comma = std::min(list.find(',', begin), list.size());
    std::string name = list.substr(begin, comma - begin);
    const auto first = name.find_first_not_of(' ');
    name = first == std::string::npos ? "" : name.substr(first, name.find_last_not_of(' ') - first + 1);
    const int target = find_target(cell, name);
    if (target < 0) {
      std::string known;
      const auto count = static_cast<int>(cell.robots.size() + cell.grippers.size());
      for (int i = 0; i < count; ++i) known += (i == 0 ? "" : ", ") + std::string(target_name(cell, i));
      arguments.fail_value("targets", &name, "any of " + known);
    } else if (std::find(targets.begin(), targets.end(), target) != targets.end()) {
      arguments.fail("names the target '" + name + "' twice.");
    } else {
      targets.push_back(target);
    }
    begin = comma + 1;
  }
  return targets;
}

std::variant<ControlAction, ControlReply> parse_register(const ControlRequest& request,
                                                         const CellDescription& cell) {
  Arguments arguments(request, {"name", "period_s", "timeout_s", "targets"});
  RegisterController action;
  action.name = arguments.text("name", "what the controller is called in events and in the status.");
  if (action.name.size() > 128) arguments.fail("argument 'name' is longer than 128 characters.");
  action.period_s = arguments.real("period_s", std::nullopt, cell.step_s, 3600.0);
  action.timeout_s = arguments.real("timeout_s", 10.0, 0.001, 86400.0);
  action.targets = read_targets(arguments, cell);
  return arguments.result(action);
}

std::variant<ControlAction, ControlReply> parse_explain(const ControlRequest& request,
                                                        const CellDescription& cell) {
  Arguments arguments(request, {"part"});
  const std::string name = arguments.text("part", "the Part (or Gripper, or Ground) to explain.");
  const int component = cell.find_component(name);
  const auto result = arguments.result(ExplainPart{component});
  if (component >= 0 || std::holds_alternative<ControlReply>(result)) return result;
  constexpr std::size_t kLongestList = 600;  // of the 1024 characters of a message
  std::string known;
  for (const ComponentDescription& c : cell.components) {
    if (known.size() + c.name.size() > kLongestList) {
      known += ", ...";
      break;
    }
    known += (known.empty() ? "" : ", ") + c.name;
  }
  return ControlReply{
      request.id,
      ControlResult::not_found,
      "There is no component '" + name.substr(0, 128) + "' in this cell; it has " + known + ".",
      {}};
}

std::variant<ControlAction, ControlReply> parse_level_of_detail(const ControlRequest& request,
                                                                const CellDescription& cell) {
  Arguments arguments(request, {"process", "level"});
  SetLevelOfDetail action;
  action.level = static_cast<int>(arguments.natural("level", std::nullopt, 1, 3));
  const std::string* process = arguments.find("process");
  if (process != nullptr && *process != "all") {
    action.process = cell.find_process(*process);
    if (action.process < 0) {
      std::string known = "all";
      for (const ProcessDescription& p : cell.processes) known += ", " + p.name;
      return ControlReply{
          request.id,
          ControlResult::not_found,
          "There is no process '" + process->substr(0, 100) + "' in this cell; there are: " + known + ".",
          {}};
    }
  }
  return arguments.result(action);
}

constexpr std::array<std::string_view, 10> kRequests{
    "get_features", "get_state",          "set_state",           "step",
    "reset",        "set_pace",           "register_controller", "unregister_controller",
    "explain_part", "set_level_of_detail"};

std::string known_requests() {
  std::string list;
  for (const auto name : kRequests) list += (list.empty() ? "" : ",") + std::string(name);
  return list;
}

}  // namespace

std::string exact_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

ControlReply features_reply(std::uint64_t id) {
  return {id,
          ControlResult::ok,
          "This server simulates one cell at a time.",
          {{"requests", known_requests()},
           {"paces", "realtime,free,lockstep"},
           {"reset_scopes", "1,2,255"},
           {"levels_of_detail", "1,2,3"},
           {"interface", "simulation_interfaces 2.1"}}};
}

std::variant<ControlAction, ControlReply> parse(const ControlRequest& request, const CellDescription& cell) {
  const std::string& name = request.request;
  if (name == "get_features") return Arguments(request, {}).result(GetFeatures{});
  if (name == "get_state") return Arguments(request, {}).result(GetState{});
  if (name == "set_state") {
    Arguments arguments(request, {"state"});
    // By number as in simulation_interfaces, or by name.
    const std::string state = arguments.text("state", "0 stopped, 1 playing, 2 paused or 3 quitting.");
    for (std::uint8_t i = 0; i <= static_cast<std::uint8_t>(SimulationState::quitting); ++i) {
      const auto known = static_cast<SimulationState>(i);
      if (state == std::to_string(i) || state == to_string(known)) return arguments.result(SetState{known});
    }
    arguments.fail_value("state", &state, "0 (stopped), 1 (playing), 2 (paused) or 3 (quitting)");
    return arguments.result(SetState{});
  }
  if (name == "step") {
    Arguments arguments(request, {"steps"});
    return arguments.result(Step{arguments.natural("steps", 1, 1, 1'000'000'000)});
  }
  if (name == "reset") {
    Arguments arguments(request, {"scope"});
    const std::uint64_t scope = arguments.natural("scope", 255, 0, 255);
    // Time and state belong together here: the state at time 0 is the initial one.
    if (scope != 1 && scope != 2 && scope != 3 && scope != 255) {
      arguments.fail_value("scope", arguments.find("scope"),
                           "1 (time), 2 (state), 3 or 255 (all): each resets both");
    }
    return arguments.result(Reset{});
  }
  if (name == "set_pace") {
    Arguments arguments(request, {"pace", "factor"});
    const std::string pace = arguments.text("pace", "realtime, free or lockstep.");
    SetPace action;
    if (pace == "realtime") {
      action.pace = Pace::realtime;
    } else if (pace == "free") {
      action.pace = Pace::free;
    } else if (pace == "lockstep") {
      action.pace = Pace::lockstep;
    } else {
      arguments.fail_value("pace", &pace, "realtime, free or lockstep");
    }
    action.factor = arguments.real("factor", 1.0, 0.001, 1000.0);
    return arguments.result(action);
  }
  if (name == "register_controller") return parse_register(request, cell);
  if (name == "set_level_of_detail") return parse_level_of_detail(request, cell);
  if (name == "explain_part") return parse_explain(request, cell);
  if (name == "unregister_controller") {
    Arguments arguments(request, {"name"});
    return arguments.result(UnregisterController{arguments.text("name", "the controller to remove.")});
  }
  return ControlReply{
      request.id,
      ControlResult::unsupported,
      "This server has no request '" + name.substr(0, 64) + "'; it has " + known_requests() + ".",
      {}};
}

}  // namespace takt
