#include "server/runtime/requests/control.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "idl/common/text.h"
#include "server/runtime/requests/entity_requests.h"
#include "server/runtime/requests/host_requests.h"
#include "server/runtime/requests/request_arguments.h"

namespace takt {
namespace {

using Arguments = RequestArguments;

std::vector<int> read_targets(Arguments& arguments, const CellDescription& cell) {
  const std::string list = arguments.text("targets", "robots, grippers and devices, separated by commas.");
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
      const int count = target_count(cell);
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
  return arguments.result<ControlAction>(action);
}

std::variant<ControlAction, ControlReply> parse_explain(const ControlRequest& request,
                                                        const CellDescription& cell) {
  Arguments arguments(request, {"part"});
  const std::string name = arguments.text("part", "the Part (or Gripper, or Ground) to explain.");
  const int component = cell.find_component(name);
  const auto result = arguments.result<ControlAction>(ExplainPart{component});
  if (component >= 0 || std::holds_alternative<ControlReply>(result)) return result;
  return no_component_reply(request.id, name, cell);
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
  return arguments.result<ControlAction>(action);
}

constexpr std::array<std::string_view, 15> kRequests{"get_features",
                                                     "get_state",
                                                     "set_state",
                                                     "step",
                                                     "reset",
                                                     "set_pace",
                                                     "register_controller",
                                                     "unregister_controller",
                                                     "explain_part",
                                                     "set_level_of_detail",
                                                     "get_entities",
                                                     "get_entity_state",
                                                     "set_entity_state",
                                                     "attach",
                                                     "detach"};

std::string known_requests() {
  return join(kRequests, ",") + "," + join(kHostRequests, ",");
}

}  // namespace

bool is_known_request(std::string_view name) {
  return std::find(kRequests.begin(), kRequests.end(), name) != kRequests.end();
}

ControlReply features_reply(std::uint64_t id) {
  return {id,
          ControlResult::ok,
          "This server simulates one scenario at a time.",
          {{"requests", known_requests()},
           {"paces", "realtime,free,lockstep"},
           {"reset_scopes", "0,1,2,4,255"},
           {"levels_of_detail", "1,2,3"},
           {"interface", "simulation_interfaces 2.1"}}};
}

std::variant<ControlAction, ControlReply> parse(const ControlRequest& request, const CellDescription& cell) {
  const std::string& name = request.request;
  if (name == "get_features") return Arguments(request, {}).result<ControlAction>(GetFeatures{});
  if (name == "get_state") return Arguments(request, {}).result<ControlAction>(GetState{});
  if (name == "set_state") {
    Arguments arguments(request, {"state"});
    // By number as in simulation_interfaces, or by name.
    const std::string state = arguments.text("state", "0 stopped, 1 playing, 2 paused or 3 quitting.");
    for (std::uint8_t i = 0; i <= static_cast<std::uint8_t>(SimulationState::quitting); ++i) {
      const auto known = static_cast<SimulationState>(i);
      if (state == std::to_string(i) || state == to_string(known))
        return arguments.result<ControlAction>(SetState{known});
    }
    arguments.fail_value("state", &state, "0 (stopped), 1 (playing), 2 (paused) or 3 (quitting)");
    return arguments.result<ControlAction>(SetState{});
  }
  if (name == "step") {
    Arguments arguments(request, {"steps"});
    return arguments.result<ControlAction>(Step{arguments.natural("steps", 1, 1, 1'000'000'000)});
  }
  if (name == "reset") {
    Arguments arguments(request, {"scope"});
    const std::uint64_t scope = arguments.natural("scope", 255, 0, 255);
    // Time and state belong together here: the state at time 0 is the initial one.
    if (scope > 7 && scope != 255) {
      arguments.fail_value("scope", arguments.find("scope"),
                           "0 or 255 (all), or a sum of 1 (time), 2 (state), each of which resets both, and "
                           "4 (spawned)");
    }
    return arguments.result<ControlAction>(Reset{scope == 4});
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
    action.factor = arguments.real("factor", 1.0, kSlowestPace, kFastestPace);
    return arguments.result<ControlAction>(action);
  }
  if (name == "register_controller") return parse_register(request, cell);
  if (name == "set_level_of_detail") return parse_level_of_detail(request, cell);
  if (name == "explain_part") return parse_explain(request, cell);
  if (name == "unregister_controller") {
    Arguments arguments(request, {"name"});
    return arguments.result<ControlAction>(
        UnregisterController{arguments.text("name", "the controller to remove.")});
  }
  if (auto parsed = parse_entity_request(request, cell)) return *std::move(parsed);
  return unknown_request_reply(request);
}

ControlReply unknown_request_reply(const ControlRequest& request) {
  return {
      request.id,
      ControlResult::unsupported,
      "This server has no request '" + request.request.substr(0, 64) + "'; it has " + known_requests() + ".",
      {}};
}

}  // namespace takt
