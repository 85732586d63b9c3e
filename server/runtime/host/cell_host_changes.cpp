// The loaded scenario with Parts more or less, and a reset that brings back what the file said.
#include "server/geometry/mesh/import.h"
#include "server/runtime/host/cell_host_world.h"
#include "server/runtime/host/scenario_edit.h"

namespace takt {

std::shared_ptr<CellHost::LoadedScenario> CellHost::changeable(std::uint64_t id) {
  auto loaded = loaded_scenario();
  if (loaded && loaded->content) return loaded;
  reply(id, ControlResult::incorrect_state,
        loaded ? "The loaded cell came from no scenario file; nothing can be spawned or deleted."
               : "No scenario is loaded; load_scenario loads one.");
  return nullptr;
}

bool CellHost::exchange_content(const Job& job, const Scenario& wanted, bool any_state,
                                std::vector<ControlRequest> changes, const std::string& done,
                                TextArguments values) {
  const std::uint64_t id = job.request.id;
  const auto loaded = loaded_scenario();
  const auto state = loaded->loop.hold();
  if (!state || (!any_state && *state != SimulationState::stopped)) {
    loaded->loop.release();
    reply(id, ControlResult::incorrect_state,
          "Parts come and go only while the simulation is stopped (set_state 0, which resets it); it is " +
              std::string(state ? to_string(*state) : "ending") + ".");
    return false;
  }
  std::shared_ptr<LoadedScenario> next;
  HostRefusal refusal;
  try {
    next = build(wanted);
  } catch (const MeshError& error) {
    refusal = {ControlResult::spawn_parse_error, error.what()};
  } catch (const std::exception& error) {
    refusal = {ControlResult::failed, error.what()};
  }
  if (!next) {
    loaded->loop.release();
    reply(id, refusal.result, refusal.message);
    return false;
  }
  next->source = loaded->source;
  next->as_loaded = loaded->as_loaded;
  next->changes = std::move(changes);
  const std::string number = std::to_string(next->loop.cell().scenario_generation);
  if (!try_exchange(id, std::move(next), *state)) return false;
  values.emplace_back("scenario_generation", number);
  reply(id, ControlResult::ok, done, std::move(values));
  return true;
}

void CellHost::change(const Job& job) {
  const auto loaded = changeable(job.request.id);
  if (!loaded) return;
  const auto* to_spawn = std::get_if<SpawnEntity>(&job.action);
  auto result = to_spawn != nullptr ? changed(*loaded->content, *to_spawn)
                                    : changed(*loaded->content, std::get<DeleteEntity>(job.action));
  if (const auto* refusal = std::get_if<HostRefusal>(&result)) {
    reply(job.request.id, refusal->result, refusal->message);
    return;
  }
  const auto& wanted = std::get<ChangedScenario>(result);
  std::vector<ControlRequest> changes = loaded->changes;
  changes.push_back(job.request);
  exchange_content(job, wanted.scenario, false, std::move(changes),
                   wanted.entity + (to_spawn != nullptr ? " is there now." : " is gone."),
                   {{"entity", wanted.entity}});
}

void CellHost::reset_spawned(const Job& job, const ResetSpawned& request) {
  const auto loaded = changeable(job.request.id);
  if (!loaded) return;
  const Scenario original = *loaded->as_loaded;
  const std::string done = request.spawned_only
                               ? "What was spawned is gone, and what was deleted is back."
                               : "The cell is back in its initial state, with the Parts of its scenario.";
  if (exchange_content(job, original, !request.spawned_only, {}, done, {{"epoch", "0"}}))
    tell(Severity::information, "reset", done);
}

}  // namespace takt
