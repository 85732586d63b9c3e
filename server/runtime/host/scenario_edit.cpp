#include "server/runtime/host/scenario_edit.h"

#include <algorithm>
#include <stdexcept>

#include "idl/common/mesh_path.h"
#include "server/runtime/host/allowed_files.h"
#include "server/scenario/scenario_names.h"

namespace takt {
namespace {

/// Names of the devices that come with a Part.
std::vector<std::string> devices_of(const ScenarioPart& part) {
  std::vector<std::string> names;
  for (const StatedDevice& device : part.devices) names.push_back(part_device_name(part.name, *device.type));
  return names;
}

bool is_taken(const Scenario& scenario, const std::string& name) {
  const auto has = [&](const auto& items) {
    return std::any_of(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  };
  return has(scenario.parts) || has(scenario.grounds) || has(scenario.robots) || has(scenario.grippers) ||
         has(scenario.devices) || has(scenario.pools) ||
         std::any_of(scenario.pools.begin(), scenario.pools.end(),
                     [&](const ScenarioPool& pool) {
                       for (int i = 1; i <= pool.count; ++i)
                         if (pool.part_name(i) == name) return true;
                       return false;
                     }) ||
         std::any_of(scenario.parts.begin(), scenario.parts.end(), [&](const ScenarioPart& part) {
           const auto names = devices_of(part);
           return std::find(names.begin(), names.end(), name) != names.end();
         });
}

/// Checks the name, and those of the Part's devices.
bool is_taken_by_another(const Scenario& scenario, ScenarioPart part, const std::string& name) {
  part.name = name;
  const auto devices = devices_of(part);
  return is_taken(scenario, name) ||
         std::any_of(devices.begin(), devices.end(), [&](const auto& d) { return is_taken(scenario, d); });
}

const ScenarioPart* find_part(const Scenario& scenario, const std::string& name) {
  const auto part = std::find_if(scenario.parts.begin(), scenario.parts.end(),
                                 [&](const ScenarioPart& p) { return p.name == name; });
  return part == scenario.parts.end() ? nullptr : &*part;
}

std::variant<ScenarioPart, Refusal> new_part(const Scenario& scenario, const requests::SpawnEntity& request) {
  if (request.uri.has_value() == request.copy_of.has_value())
    return Refusal{ControlResult::failed,
                   "A new Part needs either 'uri', a mesh file, or 'copy_of', a Part of the scenario."};
  if (request.uri && !request.mass)
    return Refusal{ControlResult::failed, "A Part of a mesh file needs the argument 'mass'."};
  if (request.copy_of && request.mesh_scale)
    return Refusal{ControlResult::failed, "The argument 'mesh_scale' belongs to 'uri'; a copy has its own."};
  ScenarioPart part;
  if (request.copy_of) {
    const ScenarioPart* original = find_part(scenario, *request.copy_of);
    if (original == nullptr)
      return Refusal{ControlResult::not_found, "There is no Part '" + *request.copy_of + "' to copy."};
    part = *original;
    // The copy is elsewhere, not in the threaded hole of the original.
    std::erase_if(part.devices, [](const StatedDevice& device) { return device.held_by() != nullptr; });
    if (request.mass && part.inertia_kg_m2) *part.inertia_kg_m2 *= *request.mass / part.mass_kg;
  } else {
    part.mesh = file_of_uri(*request.uri);
    part.mesh_scale = request.mesh_scale.value_or(1.0);
    std::error_code unreadable;
    if (!std::filesystem::exists(split_mesh_path(part.mesh).file, unreadable))
      return Refusal{ControlResult::no_resource, "There is no file " + part.mesh.string() +
                                                     ", seen from the working directory of the server."};
  }
  const auto& position = request.position;
  const auto& q = request.orientation;
  part.X_WB = {Quat(q.w, q.x, q.y, q.z).normalized().toRotationMatrix(),
               Vec3(position.x, position.y, position.z)};
  part.at_node = false;
  part.V_WB = {};
  if (request.mass) part.mass_kg = *request.mass;
  if (request.hierarchy) part.hierarchy = *request.hierarchy;
  return part;
}

}  // namespace

std::variant<ChangedScenario, Refusal> changed(const Scenario& scenario,
                                               const requests::SpawnEntity& request) {
  std::string name = request.name;
  if (!is_scenario_name(name)) {
    return Refusal{
        ControlResult::name_invalid,
        "The name '" + name.substr(0, 100) + "' is not possible; allowed are " + kAllowedScenarioNames + "."};
  }
  auto part = new_part(scenario, request);
  if (auto* refusal = std::get_if<Refusal>(&part)) return *refusal;
  auto& wanted = std::get<ScenarioPart>(part);
  for (int number = 2; request.allow_renaming && is_taken_by_another(scenario, wanted, name); ++number) {
    const std::string end = "_" + std::to_string(number);
    name = request.name.substr(0, kLongestScenarioName - end.size()) + end;
  }
  if (is_taken_by_another(scenario, wanted, name)) {
    return Refusal{ControlResult::name_not_unique,
                   "There is a '" + name + "' in this cell already; allow_renaming true finds another name."};
  }
  wanted.name = name;
  ChangedScenario result{scenario, name};
  std::erase(result.scenario.deleted, name);
  result.scenario.parts.push_back(std::move(wanted));
  for (ScenarioProcess& process : result.scenario.processes) {
    const auto& members = process.members;
    const bool home =
        !request.copy_of || std::find(members.begin(), members.end(), *request.copy_of) != members.end();
    if (process.all_members || !home) continue;
    process.members.push_back(name);
    break;
  }
  return result;
}

std::variant<ChangedScenario, Refusal> changed(const Scenario& scenario,
                                               const requests::DeleteEntity& request) {
  const std::string& name = request.entity;
  if (find_part(scenario, name) == nullptr) {
    // A gripper's jaws are components named after it.
    const bool other = is_taken(scenario, name.substr(0, name.find('/')));
    return other ? Refusal{ControlResult::failed, "'" + name + "' is no Part; only Parts can be deleted."}
                 : Refusal{ControlResult::not_found,
                           "There is no Part '" + name.substr(0, 128) + "' in this cell."};
  }
  std::string screws;
  for (const ScenarioPart& part : scenario.parts)
    if (std::any_of(part.devices.begin(), part.devices.end(), [&](const StatedDevice& device) {
          return device.held_by() != nullptr && device.held_by()->component == name;
        }))
      screws += (screws.empty() ? "" : ", ") + part.name;
  if (!screws.empty()) {
    return Refusal{ControlResult::failed, "'" + name + "' cannot go while something is screwed into it: " +
                                              screws.substr(0, 300) + "; delete that first."};
  }
  ChangedScenario result{scenario, name};
  result.scenario.deleted.push_back(name);
  std::erase_if(result.scenario.parts, [&](const ScenarioPart& part) { return part.name == name; });
  std::erase_if(result.scenario.expected, [&](const ExpectedPose& pose) { return pose.part == name; });
  for (ScenarioProcess& process : result.scenario.processes) std::erase(process.members, name);
  return result;
}

Scenario with_changes(const Scenario& scenario, std::span<const requests::Any> requests) {
  Scenario content = scenario;
  for (const requests::Any& request : requests) {
    const auto change = [&]<typename Type>(const Type& typed) {
      if constexpr (request_info<Type>().changes == RequestChanges::model) {
        auto result = changed(content, typed);
        if (const auto* refusal = std::get_if<Refusal>(&result)) throw std::runtime_error(refusal->message);
        content = std::get<ChangedScenario>(std::move(result)).scenario;
      }
    };
    std::visit(change, request);
  }
  return content;
}

}  // namespace takt
