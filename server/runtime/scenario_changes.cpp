#include "server/runtime/scenario_changes.h"

#include <algorithm>
#include <stdexcept>

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

std::variant<ScenarioPart, HostRefusal> new_part(const Scenario& scenario, const SpawnEntity& request) {
  ScenarioPart part;
  if (!request.copy_of.empty()) {
    const ScenarioPart* original = find_part(scenario, request.copy_of);
    if (original == nullptr) {
      return HostRefusal{ControlResult::not_found,
                         "There is no Part '" + request.copy_of.substr(0, 100) + "' to copy."};
    }
    part = *original;
    if (request.mass_kg && part.inertia_kg_m2) *part.inertia_kg_m2 *= *request.mass_kg / part.mass_kg;
  } else {
    std::error_code unreadable;
    if (!std::filesystem::exists(request.mesh, unreadable)) {
      return HostRefusal{ControlResult::no_resource, "There is no file " + request.mesh.string() +
                                                         ", seen from the working directory of the server."};
    }
    part.mesh = request.mesh;
    part.mesh_scale = request.mesh_scale;
  }
  part.X_WB = request.X_WB;
  part.V_WB = {};
  if (request.mass_kg) part.mass_kg = *request.mass_kg;
  if (request.hierarchy) part.hierarchy = *request.hierarchy;
  return part;
}

}  // namespace

std::variant<ChangedScenario, HostRefusal> changed(const Scenario& scenario, const SpawnEntity& request) {
  std::string name = request.name;
  for (int number = 2; request.allow_renaming && is_taken(scenario, name); ++number) {
    name = request.name + "_" + std::to_string(number);
  }
  if (!is_name(name)) {
    return HostRefusal{
        ControlResult::name_invalid,
        "The name '" + name.substr(0, 100) +
            "' is not possible; allowed are a letter, then letters, digits and underscores, at most 64."};
  }
  if (is_taken(scenario, name)) {
    return HostRefusal{
        ControlResult::name_not_unique,
        "There is a '" + name + "' in this cell already; allow_renaming true finds another name."};
  }
  auto part = new_part(scenario, request);
  if (auto* refusal = std::get_if<HostRefusal>(&part)) return *refusal;
  std::get<ScenarioPart>(part).name = name;
  ChangedScenario result{scenario, name};
  result.scenario.parts.push_back(std::get<ScenarioPart>(std::move(part)));
  for (ScenarioProcess& process : result.scenario.processes) {
    const auto& members = process.members;
    const bool home = request.copy_of.empty() ||
                      std::find(members.begin(), members.end(), request.copy_of) != members.end();
    if (process.all_members || !home) continue;
    process.members.push_back(name);
    break;
  }
  return result;
}

std::variant<ChangedScenario, HostRefusal> changed(const Scenario& scenario, const DeleteEntity& request) {
  const std::string& name = request.name;
  if (find_part(scenario, name) == nullptr) {
    // A gripper's jaws are components named after it.
    const bool other = is_taken(scenario, name.substr(0, name.find('/')));
    return other ? HostRefusal{ControlResult::failed, "'" + name + "' is no Part; only Parts can be deleted."}
                 : HostRefusal{ControlResult::not_found,
                               "There is no Part '" + name.substr(0, 128) + "' in this cell."};
  }
  ChangedScenario result{scenario, name};
  std::erase_if(result.scenario.parts, [&](const ScenarioPart& part) { return part.name == name; });
  std::erase_if(result.scenario.expected, [&](const ExpectedPose& pose) { return pose.part == name; });
  for (ScenarioProcess& process : result.scenario.processes) std::erase(process.members, name);
  return result;
}

Scenario with_changes(const Scenario& scenario, std::span<const ControlRequest> requests) {
  Scenario content = scenario;
  for (const ControlRequest& request : requests) {
    const auto parsed = parse_host_request(request);
    if (!parsed || !std::holds_alternative<HostAction>(*parsed)) continue;
    const auto& action = std::get<HostAction>(*parsed);
    const auto* to_spawn = std::get_if<SpawnEntity>(&action);
    const auto* to_delete = std::get_if<DeleteEntity>(&action);
    if (to_spawn == nullptr && to_delete == nullptr) continue;
    auto result = to_spawn != nullptr ? changed(content, *to_spawn) : changed(content, *to_delete);
    if (const auto* refusal = std::get_if<HostRefusal>(&result)) throw std::runtime_error(refusal->message);
    content = std::get<ChangedScenario>(std::move(result)).scenario;
  }
  return content;
}

}  // namespace takt
