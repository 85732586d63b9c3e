#include "server/runtime/host/cell_host.h"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <variant>

#include "idl/common/eigen_messages.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/import.h"
#include "server/runtime/host/allowed_files.h"
#include "server/runtime/host/file_lists.h"
#include "server/runtime/host/scenario_edit.h"
#include "server/scenario/urdf_robot.h"

namespace takt {
namespace {

constexpr const char* kNothingLoaded = "No scenario is loaded; load_scenario loads one.";

/// std::nullopt: the loaded scenario has content that can change.
std::optional<Refusal> unchangeable(const LoadedScenario* loaded) {
  if (loaded == nullptr) return Refusal{ControlResult::incorrect_state, kNothingLoaded};
  if (loaded->content) return std::nullopt;
  return Refusal{ControlResult::incorrect_state,
                 "The loaded cell came from no scenario file; nothing can be spawned or deleted."};
}

/// Scope 4 of a reset: spawned Parts are removed, deleted ones restored.
bool includes_spawned(const requests::Reset& request) {
  return (request.scope & 4) != 0 || request.scope == 0;
}

}  // namespace

CellHost::CellHost(HostOptions options)
    : options_(std::move(options)),
      slot_(options_, outbound_, [this] { return jobs_.stopping(); }),
      text_(options_, slot_),
      snapshots_(options_, slot_, *outbound_),
      recordings_(options_, slot_, *outbound_),
      jobs_(outbound_, [this](const HostJobs::Job& job) { return execute_job(job); }) {
  outbound_->events.cell = options_.cell;
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
    how = otherwise ? "the scenario starts from its beginning, as there is no periodic snapshot"
                    : "no scenario is loaded";
  }
  outbound_->announcement = diagnostic(events::Restarted{crash, how}, options_.cell);
  announces_.store(true);
  jobs_.opened();
}

void CellHost::submit(const ControlRequest& request) {
  const auto loaded = slot_.loaded();
  auto parsed = parse(request, loaded ? &loaded->simulation.description() : nullptr);
  if (auto* refusal = std::get_if<Refusal>(&parsed))
    return outbound_->add_reply({request.id, refusal->result, std::move(refusal->message)});
  auto& any = std::get<requests::Any>(parsed);
  const auto submit_one = [&]<typename Type>(const Type& typed) {
    constexpr RequestPhase phase = request_info<Type>().phase;
    if constexpr (std::is_same_v<Type, requests::Reset>)
      if (loaded && !loaded->changes.empty() && includes_spawned(typed)) return offer(request.id, any);
    if constexpr (phase == RequestPhase::at_once)
      outbound_->add_reply(execute(typed).reply(request.id));
    else if constexpr (phase == RequestPhase::host)
      offer(request.id, any);
    else if (loaded)
      loaded->loop->submit(request.id, any);
    else if constexpr (std::is_same_v<Type, requests::GetState> || std::is_same_v<Type, requests::SetState>)
      outbound_->add_reply(execute(typed).reply(request.id));
    else
      outbound_->add_reply(Outcome<Type>(nothing_loaded()).reply(request.id));
  };
  std::visit(submit_one, any);
}

void CellHost::offer(std::uint64_t id, requests::Any request) {
  Refusal refusal{ControlResult::failed, confine(request, options_.scenarios)};
  if (refusal.message.empty()) {
    const std::string busy = jobs_.offer({id, std::move(request)});
    if (busy.empty()) return;
    refusal = {ControlResult::incorrect_state, "The server is " + busy + "; ask again when that is done."};
  }
  outbound_->add_reply({id, refusal.result, std::move(refusal.message)});
}

ControlReply CellHost::execute_job(const HostJobs::Job& job) {
  const auto execute_one = [&]<typename Type>(const Type& typed) {
    if constexpr (request_info<Type>().phase == RequestPhase::host || std::is_same_v<Type, requests::Reset>)
      return execute(typed).reply(job.id);
    else
      return ControlReply{job.id, ControlResult::failed, "It is not for the host."};
  };
  return std::visit(execute_one, job.request);
}

Refusal CellHost::nothing_loaded() const {
  const bool loading = state_without_scenario() == SimulationState::loading_scenario;
  return {ControlResult::incorrect_state,
          loading ? "A scenario is being loaded; ask again when it is there." : kNothingLoaded};
}

Outcome<requests::GetFeatures> CellHost::execute(const requests::GetFeatures&) const {
  return {"This server simulates one scenario at a time.", features()};
}

Outcome<requests::GetEntities> CellHost::execute(const requests::GetEntities& request) const {
  const auto loaded = slot_.loaded();
  if (!loaded) return nothing_loaded();
  return entities(request, loaded->simulation.description(), *loaded->infos);
}

Outcome<requests::SetEntityInfo> CellHost::execute(const requests::SetEntityInfo& request) const {
  const auto loaded = slot_.loaded();
  if (!loaded) return nothing_loaded();
  loaded->infos->set(request);
  return request.entity + " is described so for every client.";
}

Outcome<requests::ReportGateway> CellHost::execute(const requests::ReportGateway& request) {
  if (gateways_.report(request, monotonic_now_ns())) return std::string("The status has it.");
  return Refusal{ControlResult::failed, "The status has " + std::to_string(Gateways::kMost) +
                                            " gateways already; no more are possible."};
}

Outcome<requests::GetNamedPoses> CellHost::execute(const requests::GetNamedPoses&) const {
  const auto loaded = slot_.loaded();
  if (!loaded) return nothing_loaded();
  requests::GetNamedPosesResponse response;
  if (loaded->content) {
    for (const ScenarioNamedPose& named : loaded->content->named_poses) {
      auto& pose = response.poses.emplace_back();
      pose.name = named.name;
      pose.description = named.description;
      pose.tags = named.tags;
      pose.position = to_vector(named.X_WP.p);
      pose.orientation = to_quaternion(named.X_WP.quaternion());
      if (!named.bounds_m) continue;
      pose.lower = to_vector((*named.bounds_m)[0]);
      pose.upper = to_vector((*named.bounds_m)[1]);
    }
  }
  return {"The scenario names " + counted(response.poses.size(), "pose.", "poses."), std::move(response)};
}

Outcome<requests::GetScenario> CellHost::execute(const requests::GetScenario&) const {
  const auto loaded = slot_.loaded();
  if (!loaded) return Refusal{ControlResult::no_scenario_loaded, kNothingLoaded};
  const CellDescription& cell = loaded->simulation.description();
  const ScenarioHeading heading = loaded->content ? ScenarioHeading(*loaded->content) : ScenarioHeading();
  return {"The scenario " + cell.scenario + " is loaded.",
          {cell.scenario, loaded->source ? loaded->source->file.string() : std::string(), heading.description,
           heading.tags, cell.scenario_generation}};
}

Outcome<requests::GetScenarios> CellHost::execute(const requests::GetScenarios& request) const {
  const auto loaded = slot_.loaded();
  return list_scenarios(request, options_.scenarios,
                        loaded && loaded->source ? loaded->source->file : std::filesystem::path());
}

Outcome<requests::GetSpawnables> CellHost::execute(const requests::GetSpawnables& request) const {
  const auto loaded = slot_.loaded();
  if (!loaded) return nothing_loaded();
  return list_spawnables(request, options_.scenarios, loaded->content ? &*loaded->content : nullptr,
                         loaded->simulation.description());
}

Outcome<requests::WatchPressures> CellHost::execute(const requests::WatchPressures& request) const {
  const auto loaded = slot_.loaded();
  if (!loaded) return nothing_loaded();
  return loaded->loop->output().pressures.watch(request, monotonic_now_ns());
}

Outcome<requests::GetState> CellHost::execute(const requests::GetState&) const {
  requests::GetStateResponse response;
  response.state = state_without_scenario();
  response.pace = slot_.pace();
  response.factor = slot_.pace_factor();
  return {"The server is " + std::string(words_of(response.state)) + ".", std::move(response)};
}

Outcome<requests::SetState> CellHost::execute(const requests::SetState& request) const {
  if (request.state != SimulationState::quitting) return nothing_loaded();
  if (on_quit_) on_quit_();
  return {"The server ends.", {SimulationState::quitting, 0, 0}};
}

Outcome<requests::LoadScenario> CellHost::execute(const requests::LoadScenario& request) {
  return load<requests::LoadScenario>(
      {file_of_uri(request.uri), {request.overrides, request.level_of_detail}});
}

Outcome<requests::ReloadScenario> CellHost::execute(const requests::ReloadScenario&) {
  const auto loaded = slot_.loaded();
  if (loaded && loaded->source) return load<requests::ReloadScenario>(*loaded->source);
  return Refusal{ControlResult::no_scenario_loaded,
                 "No scenario was loaded from a file, so there is no file to load again."};
}

Outcome<requests::UnloadScenario> CellHost::execute(const requests::UnloadScenario&) {
  if (!slot_.loaded()) return Refusal{ControlResult::no_scenario_loaded, "No scenario is loaded."};
  const std::string name = slot_.loaded()->simulation.description().scenario;
  const std::uint32_t generation = slot_.exchange(nullptr);
  return {outbound_->events.post(events::ScenarioUnloaded{name}), {generation, SimulationState::no_scenario}};
}

template <Request Type>
Outcome<Type> CellHost::load(const ScenarioSource& source) {
  std::shared_ptr<LoadedScenario> next;
  const auto refused = [&](ControlResult result, std::string message) {
    outbound_->events.post(events::ScenarioRefused{message});
    return Refusal{result, std::move(message)};
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
  const ScenarioHeading heading = *next->content;
  if (auto fault = try_exchange(next, SimulationState::stopped, false)) return *std::move(fault);
  return {outbound_->events.post(
              events::ScenarioLoaded{cell.scenario, cell.components.size(), cell.robots.size()}),
          {cell.scenario, source.file.string(), cell.scenario_generation, SimulationState::stopped,
           heading.description, heading.tags}};
}

std::optional<Refusal> CellHost::try_exchange(std::shared_ptr<LoadedScenario> next,
                                              std::optional<SimulationState> state, bool keep_controllers) {
  try {
    slot_.exchange(std::move(next), state, keep_controllers);
    return std::nullopt;
  } catch (const std::exception& error) {
    slot_.exchange(nullptr);
    return Refusal{ControlResult::failed, outbound_->events.post(events::ScenarioNotShown{error.what()})};
  }
}

std::variant<std::uint32_t, Refusal> CellHost::exchange_content(const Scenario& wanted, bool any_state,
                                                                std::vector<requests::Any> changes) {
  const auto loaded = slot_.loaded();
  const auto state = loaded->loop->suspend();
  Refusal refusal;
  std::shared_ptr<LoadedScenario> next;
  if (!state || (!any_state && *state != SimulationState::stopped)) {
    refusal = {ControlResult::incorrect_state,
               "Parts come and go only while the simulation is stopped (set_state stopped, which resets it); "
               "it is " +
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
  next->infos = loaded->infos;
  next->infos->keep_those_of(next->simulation.description());
  next->changes = std::move(changes);
  const std::uint32_t generation = next->simulation.description().scenario_generation;
  if (auto fault = try_exchange(std::move(next), *state, true)) return *std::move(fault);
  return generation;
}

Outcome<requests::SpawnEntity> CellHost::execute(const requests::SpawnEntity& request) {
  return change(request, " is there now.");
}

Outcome<requests::DeleteEntity> CellHost::execute(const requests::DeleteEntity& request) {
  return change(request, " is gone.");
}

template <Request Type>
Outcome<Type> CellHost::change(const Type& request, const char* done) {
  const auto loaded = slot_.loaded();
  if (auto refused = unchangeable(loaded.get())) return *std::move(refused);
  auto result = changed(*loaded->content, request);
  if (auto* refused = std::get_if<Refusal>(&result)) return std::move(*refused);
  const auto& wanted = std::get<ChangedScenario>(result);
  std::vector<requests::Any> changes = loaded->changes;
  changes.push_back(request);
  auto exchanged = exchange_content(wanted.scenario, false, std::move(changes));
  if (auto* refused = std::get_if<Refusal>(&exchanged)) return std::move(*refused);
  return {wanted.entity + done, {wanted.entity, std::get<std::uint32_t>(exchanged)}};
}

Outcome<requests::Reset> CellHost::execute(const requests::Reset& request) {
  constexpr int kSpawnedOnly = 4;
  const auto loaded = slot_.loaded();
  if (auto refused = unchangeable(loaded.get())) return *std::move(refused);
  const bool spawned_only = request.scope == kSpawnedOnly;
  const Scenario original = *loaded->as_loaded;
  auto exchanged = exchange_content(original, !spawned_only, {});
  if (auto* refused = std::get_if<Refusal>(&exchanged)) return std::move(*refused);
  return {outbound_->events.post(events::SpawnedReset{spawned_only}),
          {0, std::get<std::uint32_t>(exchanged)}};
}

void CellHost::stop() {
  jobs_.give_up();
  const auto loaded = slot_.loaded();
  if (loaded) loaded->loop->stop();
  jobs_.stop();
  if (loaded) loaded->writer.reset();  // writes the last state; its store ends ahead of the slot
  recordings_.end();
}

SimulationState CellHost::state_without_scenario() const {
  return jobs_.loading() ? SimulationState::loading_scenario : SimulationState::no_scenario;
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

std::shared_ptr<const EntityInfos> CellHost::entity_infos() const {
  const auto loaded = slot_.loaded();
  return loaded ? loaded->infos : nullptr;
}

const Simulation* CellHost::simulation() const {
  const auto loaded = slot_.loaded();
  return loaded ? &loaded->simulation : nullptr;
}

}  // namespace takt
