// Parts that are spawned into the loaded scenario, and deleted from it.
#include <algorithm>

#include "server/geometry/mesh_import.h"
#include "server/runtime/cell_host.h"

namespace takt {
namespace {

bool is_taken(const Scenario& scenario, const std::string& name) {
  const auto has = [&](const auto& items) {
    return std::any_of(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  };
  return has(scenario.parts) || has(scenario.grounds) || has(scenario.robots) || has(scenario.grippers);
}

/// As the reader of scenarios asks for it.
bool is_name(const std::string& name) {
  constexpr std::size_t kLongest = 64;
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto fits = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; };
  return !name.empty() && name.size() <= kLongest && letter(name.front()) &&
         std::all_of(name.begin(), name.end(), fits);
}

const ScenarioPart* find_part(const Scenario& scenario, const std::string& name) {
  const auto part = std::find_if(scenario.parts.begin(), scenario.parts.end(),
                                 [&](const ScenarioPart& p) { return p.name == name; });
  return part == scenario.parts.end() ? nullptr : &*part;
}

}  // namespace

const Scenario* CellHost::content(std::uint64_t id) {
  if (content_) return &*content_;
  reply(id, ControlResult::incorrect_state,
        world() ? "The loaded cell came from no scenario file; nothing can be spawned or deleted."
                : "No scenario is loaded; load_scenario loads one.");
  return nullptr;
}

void CellHost::exchange_content(std::uint64_t id, const Scenario& wanted, bool any_state,
                                ControlResult wrong_mesh, const std::string& done, TextArguments values) {
  RunLoop& loaded = *loop();
  const auto state = loaded.hold();
  if (!state || (!any_state && *state != SimulationState::stopped)) {
    loaded.release();
    reply(id, ControlResult::incorrect_state,
          "Parts come and go only while the simulation is stopped (set_state 0, which resets it); it is " +
              std::string(state ? to_string(*state) : "ending") + ".");
    return;
  }
  std::shared_ptr<World> next;
  Refusal refusal;
  try {
    next = build(wanted);
  } catch (const MeshError& error) {
    refusal = {wrong_mesh, error.what()};
  } catch (const std::exception& error) {
    refusal = {ControlResult::failed, error.what()};
  }
  if (!next) {
    loaded.release();
    reply(id, refusal.result, refusal.message);
    return;
  }
  if (!try_exchange(id, std::move(next), *state)) return;
  {
    const std::lock_guard lock(mutex_);
    with_spawned_ = !any_state;
  }
  values.emplace_back("world", std::to_string(loop()->cell().world));
  reply(id, ControlResult::ok, done, std::move(values));
}

void CellHost::spawn(std::uint64_t id, const SpawnEntity& request) {
  const Scenario* present = content(id);
  if (present == nullptr) return;
  std::string name = request.name;
  for (int number = 2; request.allow_renaming && is_taken(*present, name); ++number) {
    name = request.name + "_" + std::to_string(number);
  }
  if (!is_name(name)) {
    reply(id, ControlResult::name_invalid,
          "The name '" + name.substr(0, 100) +
              "' is not possible; allowed are a letter, then letters, digits and underscores, at most 64.");
    return;
  }
  if (is_taken(*present, name)) {
    reply(id, ControlResult::name_not_unique,
          "There is a '" + name + "' in this cell already; allow_renaming true finds another name.");
    return;
  }
  ScenarioPart part;
  if (!request.copy_of.empty()) {
    const ScenarioPart* original = find_part(*present, request.copy_of);
    if (original == nullptr) {
      reply(id, ControlResult::not_found,
            "There is no Part '" + request.copy_of.substr(0, 100) + "' to copy.");
      return;
    }
    part = *original;
    if (request.mass_kg && part.inertia_kg_m2) *part.inertia_kg_m2 *= *request.mass_kg / part.mass_kg;
  } else {
    std::error_code unreadable;
    if (!std::filesystem::exists(request.mesh, unreadable)) {
      reply(id, ControlResult::no_resource,
            "There is no file " + request.mesh.string() + ", seen from the working directory of the server.");
      return;
    }
    part.mesh = request.mesh;
    part.mesh_scale = request.mesh_scale;
  }
  part.name = name;
  part.X_WB = request.X_WB;
  part.V_WB = {};
  if (request.mass_kg) part.mass_kg = *request.mass_kg;
  if (request.hierarchy) part.hierarchy = *request.hierarchy;
  Scenario wanted = *present;
  wanted.parts.push_back(std::move(part));
  // A Part belongs to a process: to that of what it is a copy of, else to the first.
  for (ScenarioProcess& process : wanted.processes) {
    const auto& members = process.members;
    const bool home = request.copy_of.empty() ||
                      std::find(members.begin(), members.end(), request.copy_of) != members.end();
    if (process.all_members || !home) continue;
    process.members.push_back(name);
    break;
  }
  exchange_content(id, wanted, false, ControlResult::spawn_parse_error, name + " is there now.",
                   {{"entity", name}});
}

void CellHost::remove(std::uint64_t id, const DeleteEntity& request) {
  const Scenario* present = content(id);
  if (present == nullptr) return;
  const std::string& name = request.name;
  if (find_part(*present, name) == nullptr) {
    const bool other = loop()->cell().find_component(name) >= 0 || is_taken(*present, name);
    reply(id, other ? ControlResult::failed : ControlResult::not_found,
          other ? "'" + name + "' is no Part; only Parts can be deleted."
                : "There is no Part '" + name.substr(0, 128) + "' in this cell.");
    return;
  }
  Scenario wanted = *present;
  std::erase_if(wanted.parts, [&](const ScenarioPart& part) { return part.name == name; });
  std::erase_if(wanted.expected, [&](const ExpectedPose& pose) { return pose.part == name; });
  for (ScenarioProcess& process : wanted.processes) std::erase(process.members, name);
  exchange_content(id, wanted, false, ControlResult::failed, name + " is gone.", {{"entity", name}});
}

void CellHost::reset_spawned(std::uint64_t id, const ResetSpawned& request) {
  if (content(id) == nullptr) return;
  if (request.spawned_only) {
    const auto state = loop()->hold();
    loop()->release();
    if (state && *state != SimulationState::stopped) {
      reply(id, ControlResult::incorrect_state,
            "What was spawned can go alone only while the simulation is stopped; a reset of all (255) takes "
            "the "
            "rest along.");
      return;
    }
  }
  const Scenario original = *as_loaded_;
  exchange_content(id, original, true, ControlResult::failed,
                   request.spawned_only
                       ? "What was spawned is gone, and what was deleted is back."
                       : "The cell is back in its initial state, with the Parts of its scenario.",
                   {{"epoch", "0"}});
}

}  // namespace takt
