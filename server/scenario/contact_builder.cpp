#include <algorithm>
#include <stdexcept>

#include "idl/common/glob.h"
#include "idl/common/text.h"
#include "server/contact/surface/contact_roles.h"
#include "server/devices/heated_part.h"
#include "server/scenario/cell_builders.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

namespace {

bool has_temperature(const Scenario& scenario, const std::string& name) {
  return std::any_of(scenario.parts.begin(), scenario.parts.end(), [&](const ScenarioPart& part) {
    return part.name == name && part.device("heat") != nullptr;
  });
}

void require_known(const Scenario& scenario, const CellModel& cell) {
  const auto known = [&](const std::string& name) {
    return fits_a_deleted_part(scenario, name) ||
           std::any_of(cell.components.begin(), cell.components.end(),
                       [&](const Component& c) { return glob_match(name, c.name); });
  };
  const auto refuse = [&cell](const std::string& place, const std::string& name) {
    throw ScenarioError(place + ": found '" + name +
                        "', which fits no component; allowed: names or patterns (*) of " +
                        list_names(cell.components));
  };
  for (const ScenarioContactComponent& component : scenario.contact.components)
    if (!known(component.name)) refuse(component.place, component.name);
  for (const ScenarioContactPair& pair : scenario.contact.pairs)
    for (const std::string& name : pair.pair)
      if (!known(name)) refuse(pair.place, name);
}

/// The stated values of one component from all entries that fit it.
ScenarioContactComponent of_component(const Scenario& scenario, const std::string& name) {
  ScenarioContactComponent result;
  for (const ScenarioContactComponent& entry : scenario.contact.components) {
    if (!glob_match(entry.name, name)) continue;
    result.stated.replace_by(entry.stated);
    if (entry.element_edge_m) result.element_edge_m = entry.element_edge_m;
    if (entry.role != ContactRole::by_rule) result.role = entry.role;
  }
  return result;
}

double element_edge_m(const Scenario& scenario, const ScenarioContactComponent& said,
                      const SharedMesh& mesh) {
  if (said.element_edge_m) return *said.element_edge_m;
  return scenario.contact.element_edge_m.value_or(mesh.default_element_edge_m());
}

/// Base and Target of two components: from a pair entry, else from the components' entries, else by rule.
bool base_is_first(const Scenario& scenario, const CellModel& cell, std::size_t a, std::size_t b,
                   const ScenarioContactComponent& of_a, const ScenarioContactComponent& of_b) {
  const std::string& name_a = cell.components[a].name;
  const std::string& name_b = cell.components[b].name;
  int said = 0;
  for (const ScenarioContactPair& rule : scenario.contact.pairs) {
    if (rule.base.empty() || !glob_match(rule.pair, name_a, name_b)) continue;
    said = glob_match(rule.base, name_a) ? 1 : -1;
  }
  if (said != 0) return said > 0;
  if (of_a.role != of_b.role) {
    if (of_a.role == ContactRole::base || of_b.role == ContactRole::target) return true;
    if (of_a.role == ContactRole::target || of_b.role == ContactRole::base) return false;
  }
  return first_is_base(*cell.contact.surfaces[a], static_cast<int>(a), *cell.contact.surfaces[b],
                       static_cast<int>(b));
}

/// The stated values of a pair: component `a`, a Part, and `b`.
StatedContact stated_of_pair(const Scenario& scenario, const CellModel& cell, std::size_t a, std::size_t b,
                             const ScenarioContactComponent& of_a, const ScenarioContactComponent& of_b) {
  StatedContact stated = scenario.contact.defaults;
  stated.replace_by(StatedContact::joined(of_a.stated, of_b.stated));
  const bool grip = cell.components[b].type == ComponentType::gripper;
  if (grip) stated.replace_by(scenario.contact.grippers);
  for (const ScenarioContactPair& rule : scenario.contact.pairs)
    if (glob_match(rule.pair, cell.components[a].name, cell.components[b].name))
      stated.replace_by(rule.stated);
  // In a regularised grip the load creeps, and joints that hold it chatter.
  if (grip && !stated.value(&ContactParameters::friction_law)) stated.state(FrictionLaw::stick);
  return stated;
}

}  // namespace

void add_grip_friction(const Scenario& scenario, CellModel& cell) {
  std::vector<ScenarioContactComponent> said;
  for (const Component& component : cell.components) said.push_back(of_component(scenario, component.name));
  for (GripperModel& gripper : cell.grippers) {
    gripper.friction.assign(cell.components.size(), 0.0);
    for (std::size_t part = 0; part < cell.components.size(); ++part) {
      if (cell.components[part].type != ComponentType::part) continue;
      const auto with = [&](int id) {
        const auto jaw = static_cast<std::size_t>(id);
        return stated_of_pair(scenario, cell, part, jaw, said[part], said[jaw]).parameters().friction;
      };
      gripper.friction[part] = std::min(with(gripper.parameters.jaws[0]), with(gripper.parameters.jaws[1]));
    }
  }
}

void add_contact(const Scenario& scenario, const SharedMeshes& meshes, CellModel& cell) {
  if (!scenario.contact.given && !scenario.begins_with_contact()) return;
  ContactModel& contact = cell.contact;
  contact.enabled = true;
  contact.cache_unmoved_pairs = scenario.contact.cache_unmoved_pairs;
  contact.sleeping = {scenario.sleeping.method == ScenarioSleeping::Method::threshold,
                      scenario.sleeping.speed_m_per_s, scenario.sleeping.time_to_sleep_s};
  contact.parallel = scenario.contact.parallel;
  require_known(scenario, cell);
  std::vector<ScenarioContactComponent> said;
  for (std::size_t c = 0; c < cell.components.size(); ++c) {
    said.push_back(of_component(scenario, cell.components[c].name));
    try {
      contact.surfaces.push_back(meshes[c]->surface({element_edge_m(scenario, said[c], *meshes[c])}));
    } catch (const std::invalid_argument& error) {
      throw ScenarioError(scenario.file.string() + ": " + cell.components[c].name + " (" +
                          cell.description.components[c].mesh_uri + "): contact: " + error.what());
    }
  }
  for (const ComponentPair& pair : cell.pairs) {
    if (pair.kind != PairKind::hold) continue;
    const auto a = static_cast<std::size_t>(pair.base), b = static_cast<std::size_t>(pair.target);
    const std::string& name_a = cell.components[a].name;
    const std::string& name_b = cell.components[b].name;
    const StatedContact stated = stated_of_pair(scenario, cell, a, b, said[a], said[b]);
    ContactPairModel model;
    for (const ScenarioContactPair& rule : scenario.contact.pairs) {
      if (!glob_match(rule.pair, name_a, name_b)) continue;
      if (rule.force) model.force = *rule.force;
      if (rule.friction_at_degC.empty()) continue;
      if (!has_temperature(scenario, name_a) && !has_temperature(scenario, name_b))
        throw ScenarioError(rule.place + ": found friction_at_degC for " + name_a + " and " + name_b +
                            "; allowed: only where one of them is a part with `heat`");
      model.friction_at_K = rule.friction_at_degC;
      for (auto& [temperature, friction] : model.friction_at_K) temperature += kZeroCelsius_K;
    }
    const bool base_first = base_is_first(scenario, cell, a, b, said[a], said[b]);
    model.base = base_first ? pair.base : pair.target;
    model.target = base_first ? pair.target : pair.base;
    model.law = contact_law(stated.parameters());
    contact.pairs.push_back(model);
  }
  std::sort(contact.pairs.begin(), contact.pairs.end(),
            [](const ContactPairModel& x, const ContactPairModel& y) {
              return std::pair{x.base, x.target} < std::pair{y.base, y.target};
            });
}

MeshUse mesh_use(const Scenario& scenario, const std::string& component, const SharedMesh& mesh,
                 bool usually_carries_elements) {
  const ScenarioContactComponent said = of_component(scenario, component);
  return {element_edge_m(scenario, said, mesh),
          said.role == ContactRole::by_rule ? usually_carries_elements : said.role == ContactRole::base};
}

}  // namespace takt
