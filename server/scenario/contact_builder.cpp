#include <algorithm>
#include <map>
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
    if (entry.resample) result.resample = entry.resample;
    if (entry.field_spacing_m) result.field_spacing_m = entry.field_spacing_m;
    if (entry.role != ContactRole::by_rule) result.role = entry.role;
  }
  return result;
}

double element_edge_m(const Scenario& scenario, const ScenarioContactComponent& said,
                      const SharedMesh& mesh) {
  if (said.element_edge_m) return *said.element_edge_m;
  return scenario.contact.element_edge_m.value_or(mesh.default_element_edge_m());
}

/// 1: of two components the first is the Base, from a pair entry or from the components' entries; -1: the second;
/// 0: the rule decides.
int stated_base(const Scenario& scenario, const std::string& name_a, const std::string& name_b,
                const ScenarioContactComponent& of_a, const ScenarioContactComponent& of_b) {
  int said = 0;
  for (const ScenarioContactPair& rule : scenario.contact.pairs) {
    if (rule.base.empty() || !glob_match(rule.pair, name_a, name_b)) continue;
    said = glob_match(rule.base, name_a) ? 1 : -1;
  }
  if (said != 0 || of_a.role == of_b.role) return said;
  if (of_a.role == ContactRole::base || of_b.role == ContactRole::target) return 1;
  if (of_a.role == ContactRole::target || of_b.role == ContactRole::base) return -1;
  return 0;
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
  // The sliding speed is a parameter of regularised friction alone. In a regularised grip the load creeps, and joints that
  // hold it chatter.
  if (!grip && !stated.value(&ContactParameters::friction_law) &&
      stated.value(&ContactParameters::friction_velocity_m_per_s))
    stated.state(FrictionLaw::regularised);
  return stated;
}

/// With the layers of both sides in series.
void let_both_yield(const ContactParameters& of_a, const ContactParameters& of_b, ContactPairKind& kind) {
  const double a = contact_law(of_a).stiffness_Pa_per_m, b = contact_law(of_b).stiffness_Pa_per_m;
  const double both = a * b / (a + b);
  kind.law.tangential_stiffness_Pa_per_m *= both / kind.law.stiffness_Pa_per_m;
  kind.law.stiffness_Pa_per_m = both;
}

/// What the scenario says of a pair.
ContactPairKind kind_of_pair(const Scenario& scenario, const CellModel& cell, std::size_t a, std::size_t b,
                             const ScenarioContactComponent& of_a, const ScenarioContactComponent& of_b) {
  const std::string& name_a = cell.components[a].name;
  const std::string& name_b = cell.components[b].name;
  ContactPairKind kind;
  for (const ScenarioContactPair& rule : scenario.contact.pairs) {
    if (!glob_match(rule.pair, name_a, name_b)) continue;
    if (rule.force) kind.force = *rule.force;
    if (rule.friction_at_degC.empty()) continue;
    if (!has_temperature(scenario, name_a) && !has_temperature(scenario, name_b))
      throw ScenarioError(rule.place + ": found friction_at_degC for " + name_a + " and " + name_b +
                          "; allowed: only where one of them is a part with `heat`");
    kind.friction_at_K = rule.friction_at_degC;
    for (auto& [temperature, friction] : kind.friction_at_K) temperature += kZeroCelsius_K;
  }
  const ContactParameters parameters = stated_of_pair(scenario, cell, a, b, of_a, of_b).parameters();
  kind.law = contact_law(parameters);
  kind.depth = parameters.depth;
  if (kind.depth == DepthSource::pressure_field)
    let_both_yield(stated_of_pair(scenario, cell, a, b, of_a, of_a).parameters(),
                   stated_of_pair(scenario, cell, a, b, of_b, of_b).parameters(), kind);
  return kind;
}

/// Components of one class are named by the same entries: the scenario says the same of them.
struct Classes {
  std::vector<std::int32_t> of;     ///< by component
  std::vector<std::size_t> first;   ///< by class: its first component
  std::vector<std::size_t> second;  ///< and its second one, or the first

  std::size_t count() const { return first.size(); }
};

Classes classes_of(const Scenario& scenario, const CellModel& cell) {
  Classes classes;
  std::map<std::vector<bool>, std::int32_t> known;
  const bool heat_counts =
      std::any_of(scenario.contact.pairs.begin(), scenario.contact.pairs.end(),
                  [](const ScenarioContactPair& rule) { return !rule.friction_at_degC.empty(); });
  for (std::size_t c = 0; c < cell.components.size(); ++c) {
    const std::string& name = cell.components[c].name;
    std::vector<bool> said{cell.components[c].type == ComponentType::part,
                           cell.components[c].type == ComponentType::gripper,
                           heat_counts && has_temperature(scenario, name)};
    for (const ScenarioContactComponent& entry : scenario.contact.components)
      said.push_back(glob_match(entry.name, name));
    for (const ScenarioContactPair& rule : scenario.contact.pairs) {
      for (const std::string& pattern : rule.pair) said.push_back(glob_match(pattern, name));
      said.push_back(glob_match(rule.base, name));
    }
    const auto [found, is_new] = known.emplace(std::move(said), static_cast<std::int32_t>(known.size()));
    classes.of.push_back(found->second);
    if (is_new) {
      classes.first.push_back(c);
      classes.second.push_back(c);
    } else if (std::size_t& second = classes.second[static_cast<std::size_t>(found->second)];
               second == classes.first[static_cast<std::size_t>(found->second)]) {
      second = c;
    }
  }
  return classes;
}

/// The pairs that may hold each other, with the Base that the scenario or the rule gives them.
void add_pairs(const Scenario& scenario, const std::vector<ScenarioContactComponent>& said, CellModel& cell) {
  const Classes classes = classes_of(scenario, cell);
  const std::size_t n = classes.count();
  std::vector<ContactPairKind> kinds(n * n);
  std::vector<int> bases(n * n,
                         0);  // by the classes of two components, of which the Part or lower one is first
  const auto holds = [&cell](std::size_t a, std::size_t b) {
    return pair_kind(cell.components[a].type, cell.components[b].type) == PairKind::hold;
  };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t x = classes.first[i], y = i == k ? classes.second[k] : classes.first[k];
      if (x == y || !holds(x, y)) continue;
      bases[i * n + k] =
          stated_base(scenario, cell.components[x].name, cell.components[y].name, said[x], said[y]);
      if (k < i) continue;
      const bool in_order = base_first(cell.components, static_cast<int>(x), static_cast<int>(y));
      const std::size_t a = in_order ? x : y, b = in_order ? y : x;
      kinds[i * n + k] = kinds[k * n + i] = kind_of_pair(scenario, cell, a, b, said[a], said[b]);
    }
  }
  ContactPairs pairs(classes.of, std::move(kinds), n);
  const auto first_carries = [&](std::size_t a, std::size_t b) {
    const int stated =
        bases[static_cast<std::size_t>(classes.of[a]) * n + static_cast<std::size_t>(classes.of[b])];
    const auto is_belt = [&cell](std::size_t c) {
      const std::vector<int>& belts = cell.contact.belts;
      return std::find(belts.begin(), belts.end(), static_cast<int>(c)) != belts.end();
    };
    // The material of a moving surface passes the elements of the other side.
    if (const bool of_a = is_belt(a); of_a || is_belt(b)) {
      if (stated != 0 && (stated > 0) == of_a)
        throw ScenarioError(scenario.file.string() + ": contact: found the base '" +
                            cell.components[of_a ? a : b].name +
                            "', whose surface a conveyor moves; allowed: the part as base of such a pair");
      return !of_a;
    }
    if (stated != 0) return stated > 0;
    return first_is_base(*cell.contact.surfaces[a], static_cast<int>(a), *cell.contact.surfaces[b],
                         static_cast<int>(b));
  };
  for (std::size_t base = 0; base < cell.components.size(); ++base) {
    for (std::size_t target = 0; target < cell.components.size(); ++target) {
      if (base == target || !holds(base, target)) continue;
      const bool in_order = base_first(cell.components, static_cast<int>(base), static_cast<int>(target));
      if (in_order ? first_carries(base, target) : !first_carries(target, base))
        pairs.add(static_cast<int>(base), static_cast<int>(target));
    }
  }
  pairs.shrink_to_fit();
  cell.contact.pairs = std::move(pairs);
}

void note_resampling(const std::string& component, const ResamplingReport& report, CellModel& cell) {
  if (report.spacing_m == 0.0) return;
  cell.import_notes.push_back({component,
                               component + ": " + sentence_of(report) + ". `contact.components." + component +
                                   ".resample: never` keeps the triangles.",
                               {}});
}

ContactSurfaceOptions surface_options(const Scenario& scenario, const ScenarioContactComponent& said,
                                      const SharedMesh& mesh) {
  return {element_edge_m(scenario, said, mesh), said.resample.value_or(scenario.contact.resample)};
}

/// False for a mesh that add_contact refuses, too.
bool is_resampled(SharedMesh& mesh, const ContactSurfaceOptions& options) {
  try {
    return mesh.surface(options)->resampling().spacing_m > 0.0;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

void note_field(const std::string& component, const DistanceField::Report& report, CellModel& cell) {
  const auto mm = [](double length_m) { return number_text(1e3 * length_m, 3) + " mm"; };
  std::string sentence = component + ": its distance field has nodes every " + mm(report.spacing_m) +
                         " and takes " + number_text(1e-6 * static_cast<double>(report.bytes), 3) +
                         " MB; below its surface it is wrong by " + mm(report.mean_error_m) +
                         " on average and " + mm(report.largest_error_m) + " at most, at " +
                         place_text(report.largest_at) + ".";
  if (!report.resolves)
    sentence +=
        " It does not resolve the shape, whose walls or details are smaller than some nodes. Remedy: set "
        "contact.components." +
        component + ".field_spacing_m to a smaller value, or depth: polygonal.";
  cell.import_notes.push_back({component, sentence, {}});
}

/// The distance fields that pairs take their depths from.
void add_fields(const Scenario& scenario, const std::vector<ScenarioContactComponent>& said,
                const SharedMeshes& meshes, CellModel& cell) {
  ContactModel& contact = cell.contact;
  const auto takes_field = [](const auto& pair) { return pair.depth != DepthSource::polygonal; };
  if (std::none_of(contact.pairs.kinds().begin(), contact.pairs.kinds().end(), takes_field)) return;
  contact.fields.assign(cell.components.size(), nullptr);
  for (const ContactPairModel& pair : contact.pairs) {
    const auto target = static_cast<std::size_t>(pair.target);
    if (!takes_field(pair) || contact.fields[target] != nullptr) continue;
    const auto& surface = contact.surfaces[target];
    const std::optional<double> stated =
        said[target].field_spacing_m ? said[target].field_spacing_m : scenario.contact.field_spacing_m;
    try {
      contact.fields[target] =
          meshes[target]->field(surface, stated ? *stated : default_field_spacing_m(*surface));
    } catch (const std::invalid_argument& error) {
      throw ScenarioError(scenario.file.string() + ": " + cell.components[target].name +
                          ": contact: " + error.what());
    }
    note_field(cell.components[target].name, contact.fields[target]->report(), cell);
  }
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
      contact.surfaces.push_back(meshes[c]->surface(surface_options(scenario, said[c], *meshes[c])));
    } catch (const std::invalid_argument& error) {
      throw ScenarioError(scenario.file.string() + ": " + cell.components[c].name + " (" +
                          cell.description.components[c].mesh_uri + "): contact: " + error.what());
    }
    note_resampling(cell.components[c].name, contact.surfaces.back()->resampling(), cell);
  }
  add_pairs(scenario, said, cell);
  add_fields(scenario, said, meshes, cell);
}

MeshUse mesh_use(const Scenario& scenario, const std::string& component, SharedMesh& mesh,
                 bool usually_carries_elements) {
  const ScenarioContactComponent said = of_component(scenario, component);
  const ContactSurfaceOptions options = surface_options(scenario, said, mesh);
  return {options.element_edge_m,
          said.role == ContactRole::by_rule ? usually_carries_elements : said.role == ContactRole::base,
          is_resampled(mesh, options)};
}

}  // namespace takt
