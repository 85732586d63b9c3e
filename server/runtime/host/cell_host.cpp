#include "server/runtime/host/cell_host.h"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <variant>

#include "idl/common/text.h"
#include "server/geometry/mesh/import.h"
#include "server/runtime/host/allowed_files.h"
#include "server/runtime/host/scenario_edit.h"
#include "server/scenario/urdf_robot.h"

namespace takt {
namespace {

const Outcome kNothingLoaded{ControlResult::incorrect_state,
                             "No scenario is loaded; load_scenario loads one."};

/// Nothing: the loaded scenario has content that can change.
std::optional<Outcome> unchangeable(const LoadedScenario* loaded) {
  if (loaded == nullptr) return kNothingLoaded;
  if (loaded->content) return std::nullopt;
  return Outcome{ControlResult::incorrect_state,
                 "The loaded cell came from no scenario file; nothing can be spawned or deleted."};
}

}  // namespace

CellHost::CellHost(HostOptions options)
    : options_(std::move(options)),
      slot_(options_, outbound_, [this] { return jobs_.stopping(); }),
      snapshots_(options_, slot_, *outbound_),
      recordings_(options_, slot_, *outbound_),
      jobs_(outbound_, [this](const Job& job) { return execute(job); }) {
  slot_.set_on_exchange([this](LoadedScenario* loaded) {
    snapshots_.attach(loaded);
    if (loaded != nullptr) recordings_.begin(*loaded);
  });
}

CellHost::~CellHost() {
  stop();
}

void CellHost::set_on_quit(std::function<void()> on_quit) {
  on_quit_ = on_quit;
  slot_.set_on_quit(std::move(on_quit));
}

void CellHost::open(const ScenarioSource& source) {
  open_first(slot_.build(source));
}

void CellHost::open(std::shared_ptr<const CellModel> model) {
  open_first(slot_.build(std::make_shared<CellModel>(*model), 0.0));
}

void CellHost::open_first(std::shared_ptr<LoadedScenario> first) {
  snapshots_.begin();
  recordings_.open_log();
  slot_.exchange(std::move(first));
  jobs_.opened();
}

void CellHost::resume(const std::string& crash, const std::optional<ScenarioSource>& otherwise) {
  const auto session = snapshots_.session();
  recordings_.open_log_again();
  std::string how;
  if (session) {
    try {
      how = snapshots_.resume(*session);
    } catch (const std::exception& error) {
      slot_.exchange(nullptr);
      how = std::string("what was loaded could not be loaded again, so nothing is loaded: ") + error.what();
    }
  } else {
    slot_.exchange(otherwise ? slot_.build(*otherwise) : nullptr);
    how = otherwise ? "the scenario begins anew, as there is no periodic snapshot" : "no scenario is loaded";
  }
  outbound_->announcement = DiagnosticEvent{Severity::error, "restarted", options_.cell, "",
                                            "The server " + crash + " and was started again: " + how + "."};
  announces_.store(true);
  jobs_.opened();
}

void CellHost::submit(const ControlRequest& request) {
  const auto loaded = slot_.loaded();
  auto parsed = parse_host_request(request, loaded && !loaded->changes.empty());
  if (!parsed) {
    if (loaded)
      loaded->loop->submit(request);
    else
      answer_without_scenario(request);
    return;
  }
  if (auto* answer = std::get_if<ControlReply>(&*parsed)) {
    outbound_->add_reply(std::move(*answer));
    return;
  }
  auto& action = std::get<HostAction>(*parsed);
  if (const auto* to_watch = std::get_if<WatchPressures>(&action); to_watch != nullptr && loaded) {
    outbound_->add_reply(loaded->loop->output().pressures.watch(request.id, *to_watch, monotonic_now_ns()));
  } else if (to_watch != nullptr) {
    answer_without_scenario(request);
  } else if (std::string refusal = confine(action, options_.scenarios); !refusal.empty()) {
    outbound_->add_reply(request.id, {ControlResult::failed, std::move(refusal)});
  } else if (const std::string busy = jobs_.offer({request, std::move(action)}); !busy.empty()) {
    outbound_->add_reply(request.id, {ControlResult::incorrect_state,
                                      "The server is " + busy + "; ask again when that is done."});
  }
}

void CellHost::answer_without_scenario(const ControlRequest& request) {
  const SimulationState state = state_without_scenario();
  const auto parsed = parse(request, CellDescription{});
  const auto* action = std::get_if<ControlAction>(&parsed);
  const auto* to_state = action == nullptr ? nullptr : std::get_if<SetState>(action);
  const bool is_of_host =
      std::find(kHostRequests.begin(), kHostRequests.end(), request.request) != kHostRequests.end();
  if (to_state != nullptr && to_state->state == SimulationState::quitting) {
    outbound_->add_reply(request.id, {ControlResult::ok, "The server ends.", {{"state", "3"}}});
    if (on_quit_) on_quit_();
  } else if (!is_known_request(request.request) && !is_of_host) {
    outbound_->add_reply(unknown_request_reply(request));
  } else if (request.request == "get_features") {
    outbound_->add_reply(features_reply(request.id));
  } else if (request.request == "get_state") {
    outbound_->add_reply(request.id, {ControlResult::ok,
                                      "The server is " + std::string(to_string(state)) + ".",
                                      {{"state", std::to_string(static_cast<int>(state))},
                                       {"state_name", std::string(to_string(state))},
                                       {"pace", std::string(to_string(slot_.pace()))},
                                       {"factor", exact_text(slot_.pace_factor())},
                                       {"time", "0"},
                                       {"step", "0"},
                                       {"epoch", "0"},
                                       {"fault", ""}}});
  } else {
    outbound_->add_reply(request.id, state == SimulationState::loading_world
                                         ? Outcome{ControlResult::incorrect_state,
                                                   "A scenario is being loaded; ask again when it is there."}
                                         : kNothingLoaded);
  }
}

Outcome CellHost::execute(const Job& job) {
  return std::visit([&](const auto& request) { return execute(job, request); }, job.action);
}

Outcome CellHost::execute(const Job&, const LoadScenario& request) {
  return load({request.file, request.options});
}

Outcome CellHost::execute(const Job&, const ReloadScenario&) {
  const auto loaded = slot_.loaded();
  if (loaded && loaded->source) return load(*loaded->source);
  return {ControlResult::no_world_loaded, "No scenario was loaded from a file; there is none to load again."};
}

Outcome CellHost::execute(const Job&, const UnloadScenario&) {
  const auto loaded = slot_.loaded();
  if (!loaded) return {ControlResult::no_world_loaded, "No scenario is loaded."};
  const std::string message =
      "Scenario " + loaded->simulation.description().scenario + " was unloaded; none is loaded now.";
  slot_.exchange(nullptr);
  report(Severity::information, "scenario_unloaded", message);
  return {
      ControlResult::ok, message, {{"state", std::to_string(static_cast<int>(SimulationState::no_world))}}};
}

Outcome CellHost::load(const ScenarioSource& source) {
  std::shared_ptr<LoadedScenario> next;
  const auto refused = [&](ControlResult result, std::string message) {
    report(Severity::warning, "scenario_refused", message);
    return Outcome{result, std::move(message)};
  };
  std::error_code unreadable;
  if (!std::filesystem::exists(source.file, unreadable))
    return refused(ControlResult::not_found, "There is no file " + source.file.string() +
                                                 ", seen from the working directory of the server.");
  try {
    next = slot_.build(source);
  } catch (const MissingFileError& error) {
    return refused(ControlResult::missing_assets, error.what());
  } catch (const ScenarioError& error) {
    return refused(ControlResult::resource_parse_error, error.what());
  } catch (const MeshError& error) {
    return refused(ControlResult::unsupported_assets, error.what());
  } catch (const UrdfError& error) {
    return refused(ControlResult::unsupported_assets, error.what());
  } catch (const std::exception& error) {
    return refused(ControlResult::failed, error.what());
  }
  const CellDescription& cell = next->simulation.description();
  const std::string message = "Scenario " + cell.scenario +
                              " is loaded: " + std::to_string(cell.components.size()) + " components, " +
                              std::to_string(cell.robots.size()) + " robots; the simulation is stopped.";
  if (auto fault = try_exchange(next, SimulationState::stopped, false)) return *std::move(fault);
  report(Severity::information, "scenario_loaded", message);
  return {ControlResult::ok,
          message,
          {{"scenario", cell.scenario},
           {"uri", source.file.string()},
           {"scenario_generation", std::to_string(cell.scenario_generation)},
           {"state", std::to_string(static_cast<int>(SimulationState::stopped))}}};
}

std::optional<Outcome> CellHost::try_exchange(std::shared_ptr<LoadedScenario> next,
                                              std::optional<SimulationState> state, bool keep_controllers) {
  try {
    slot_.exchange(std::move(next), state, keep_controllers);
    return std::nullopt;
  } catch (const std::exception& error) {
    slot_.exchange(nullptr);
    const std::string message =
        std::string("The scenario was read but cannot be shown outside; none is loaded now: ") + error.what();
    report(Severity::error, "scenario_refused", message);
    return Outcome{ControlResult::failed, message};
  }
}

Outcome CellHost::exchange_content(const Scenario& wanted, bool any_state,
                                   std::vector<ControlRequest> changes, std::string done,
                                   TextArguments values) {
  const auto loaded = slot_.loaded();
  const auto state = loaded->loop->suspend();
  Outcome refusal;
  std::shared_ptr<LoadedScenario> next;
  if (!state || (!any_state && *state != SimulationState::stopped)) {
    refusal = {
        ControlResult::incorrect_state,
        "Parts come and go only while the simulation is stopped (set_state 0, which resets it); it is " +
            std::string(state ? to_string(*state) : "ending") + "."};
  } else {
    try {
      next = slot_.build(wanted);
    } catch (const MeshError& error) {
      refusal = {ControlResult::spawn_parse_error, error.what()};
    } catch (const std::exception& error) {
      refusal = {ControlResult::failed, error.what()};
    }
  }
  if (!next) {
    loaded->loop->resume();
    return refusal;
  }
  next->source = loaded->source;
  next->as_loaded = loaded->as_loaded;
  next->changes = std::move(changes);
  values.emplace_back("scenario_generation",
                      std::to_string(next->simulation.description().scenario_generation));
  if (auto fault = try_exchange(std::move(next), *state, true)) return *std::move(fault);
  return {ControlResult::ok, std::move(done), std::move(values)};
}

Outcome CellHost::execute(const Job& job, const SpawnEntity& request) {
  return change(job, request, " is there now.");
}

Outcome CellHost::execute(const Job& job, const DeleteEntity& request) {
  return change(job, request, " is gone.");
}

template <typename Change>
Outcome CellHost::change(const Job& job, const Change& request, const char* done) {
  const auto loaded = slot_.loaded();
  if (auto refused = unchangeable(loaded.get())) return *std::move(refused);
  auto result = changed(*loaded->content, request);
  if (auto* refused = std::get_if<Outcome>(&result)) return std::move(*refused);
  const auto& wanted = std::get<ChangedScenario>(result);
  std::vector<ControlRequest> changes = loaded->changes;
  changes.push_back(job.request);
  return exchange_content(wanted.scenario, false, std::move(changes), wanted.entity + done,
                          {{"entity", wanted.entity}});
}

Outcome CellHost::execute(const Job&, const ResetSpawned& request) {
  const auto loaded = slot_.loaded();
  if (auto refused = unchangeable(loaded.get())) return *std::move(refused);
  const std::string done = request.spawned_only
                               ? "What was spawned is gone, and what was deleted is back."
                               : "The cell is back in its initial state, with the Parts of its scenario.";
  const Scenario original = *loaded->as_loaded;
  Outcome outcome = exchange_content(original, !request.spawned_only, {}, done, {{"epoch", "0"}});
  if (outcome.result == ControlResult::ok) report(Severity::information, "reset", done);
  return outcome;
}

void CellHost::stop() {
  jobs_.give_up();
  if (const auto loaded = slot_.loaded()) loaded->loop->stop();
  jobs_.stop();
  recordings_.end();
}

SimulationState CellHost::state_without_scenario() const {
  return jobs_.loading() ? SimulationState::loading_world : SimulationState::no_world;
}

std::optional<LoopStatus> CellHost::idle_status() const {
  if (slot_.loaded()) return std::nullopt;
  LoopStatus status;
  status.state = state_without_scenario();
  status.pace = slot_.pace();
  status.pace_factor = slot_.pace_factor();
  status.wall_time_s = static_cast<double>(monotonic_now_ns() - outbound_->began_ns) * 1e-9;
  return status;
}

RunLoop* CellHost::loop() const {
  const auto loaded = slot_.loaded();
  return loaded ? &*loaded->loop : nullptr;
}

const Simulation* CellHost::simulation() const {
  const auto loaded = slot_.loaded();
  return loaded ? &loaded->simulation : nullptr;
}

}  // namespace takt
