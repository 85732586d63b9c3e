#include "server/scenario/scenario_reader.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <span>
#include <sstream>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fields/fields.h"
#include "server/scenario/scenario_names.h"
#include "server/scenario/scenario_writer.h"
#include "server/simulation/solver/integrator.h"

namespace takt {

namespace {

/// Whether the entries of a section have names that the user chooses.
bool has_entries(const std::string& section) {
  const KeyInfo info = scenario_info();
  const auto found = std::find_if(info.items.begin(), info.items.end(),
                                  [&](const KeyInfo& item) { return item.key == section; });
  return found != info.items.end() && !found->items.empty() && found->items.front().key == "*";
}

std::vector<std::string> keys_of(const YAML::Node& map) {
  std::vector<std::string> keys;
  for (const auto& entry : map) keys.push_back(entry.first.as<std::string>(std::string()));
  return keys;
}

/// "a.b[2].c" and "a.b.2.c" are the same key.
std::vector<std::string> parts_of(const std::string& key, const std::string& text) {
  std::string dotted;
  for (std::size_t i = 0; i < key.size(); ++i) {
    if (key[i] != '[') {
      dotted += key[i];
      continue;
    }
    const std::size_t close = key.find(']', i);
    const bool ends = close != std::string::npos &&
                      (close + 1 == key.size() || key[close + 1] == '.' || key[close + 1] == '[');
    if (i == 0 || !ends || !finite_number(key.substr(i + 1, close - i - 1)))
      throw ScenarioError("--set " + text + ": found '" + key.substr(i) +
                          "'; allowed: the number of an element in brackets, e.g. position_m[2]");
    dotted += "." + key.substr(i + 1, close - i - 1);
    i = close;
  }
  std::vector<std::string> parts;
  std::stringstream stream(dotted);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  return parts;
}

/// An element of a list, by its number.
std::size_t element_index(const YAML::Node& list, const std::string& key, const std::string& text) {
  const auto index = finite_number(key);
  if (index && *index >= 0.0 && *index == std::floor(*index) && *index < static_cast<double>(list.size()))
    return static_cast<std::size_t>(*index);
  throw ScenarioError("--set " + text + ": found '" + key + "'; allowed: an element of the list, " +
                      (list.size() == 0 ? "which is empty" : "0 to " + std::to_string(list.size() - 1)));
}

// --set: replaces one value of the tree. Missing keys are created; the reader later refuses unknown ones.
void apply_override(YAML::Node& root, const std::string& text, const ScenarioOptions& options,
                    YamlSource& source) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ScenarioError("--set " + text +
                        ": found no '='; allowed: key=value with a dotted key of the scenario file");
  }
  const std::vector<std::string> keys = parts_of(text.substr(0, equals), text);
  YAML::Node value;
  try {
    value = parse_yaml(text.substr(equals + 1));
  } catch (const YAML::Exception& error) {
    throw ScenarioError("--set " + text + ": the value is not valid YAML: " + error.msg);
  }
  const YAML::Node group = std::as_const(root)[keys.front()];
  if (keys.size() > 2 && has_entries(keys.front()) && !(group.IsMap() && group[keys[1]].IsDefined()))
    throw ScenarioError("--set " + text + ": found '" + keys[1] + "'; allowed: an entry of " + keys.front() +
                        " in the scenario" + (group.IsMap() ? ": " + list_names(keys_of(group)) : "") +
                        "; a new one is given whole, --set '" + keys.front() + "." + keys[1] + "={...}'");
  YAML::Node node = root;
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
    YAML::Node next = node.IsSequence() ? node[element_index(node, keys[i], text)] : node[keys[i]];
    if (next.IsDefined() && !next.IsNull() && !next.IsMap() && !next.IsSequence()) {
      throw ScenarioError("--set " + text + ": '" + keys[i] +
                          "' is not a mapping; allowed: the keys of the scenario file");
    }
    node.reset(next);
  }
  if (node.IsSequence()) {
    node[element_index(node, keys.back(), text)] = value;
  } else if (keys.size() > 1 && finite_number(keys.back()) && !node.IsMap()) {
    throw ScenarioError("--set " + text + ": found no list '" + keys[keys.size() - 2] +
                        "' in the scenario; allowed: an element of a list that it has, or the whole list, " +
                        "--set '" + join(std::span(keys).first(keys.size() - 1), ".") + "=[...]'");
  } else {
    node[keys.back()] = value;
  }
  const std::string key = join(keys, ".");
  const auto option = options.option_of.find(key);
  source.overridden[key] = option == options.option_of.end() ? "--set" : option->second;
}

/// Names are unique among components, robots and devices, and members of processes exist.
void check_names(const Fields& f, const Scenario& scenario) {
  std::set<std::string> names, members;
  const auto check = [&](const std::string& group, const std::string& name) {
    f.check(is_scenario_name(name), group, "the name '" + name + "'", kAllowedScenarioNames);
    f.check(names.insert(name).second, group, "the name '" + name + "' again",
            "names that are unique among parts, pools, grounds, robots, grippers and devices");
  };
  for (const std::string group : {"parts", "pools", "grounds", "robots", "grippers"})
    for (const auto& [section, name] : f.names())
      if (section == group) check(group, name);
  for (const ScenarioProcess& process : scenario.processes)
    for (const std::string& member : process.members)
      f.check(names.count(member) != 0, "processes", "the member '" + member + "' of " + process.name,
              "names of parts, grounds, robots and grippers of this scenario");
  for (const StatedDevice& device : scenario.devices) check(device.type->key, device.name);
  for (const ScenarioPart& part : scenario.parts)
    for (const StatedDevice& device : part.devices)
      check(std::string("parts (") + device.type->key + ")", part_device_name(part.name, *device.type));
}

/// Checks the components to which devices fix Parts.
void check_holders(const Scenario& scenario) {
  const auto fixes = [](const StatedDevice& device) { return device.held_by() != nullptr; };
  for (const ScenarioPart& part : scenario.parts) {
    for (const StatedDevice& device : part.devices) {
      if (!fixes(device)) continue;
      const HeldBy& held = *device.held_by();
      const auto is_it = [&held](const auto& item) { return item.name == held.component; };
      const auto into = std::find_if(scenario.parts.begin(), scenario.parts.end(), is_it);
      const bool on_ground = std::any_of(scenario.grounds.begin(), scenario.grounds.end(), is_it);
      if ((into == scenario.parts.end() && !on_ground) || held.component == part.name)
        throw ScenarioError(held.place + ": found '" + held.component +
                            "'; allowed: another part, or a ground, of this scenario");
      if (into != scenario.parts.end() && std::any_of(into->devices.begin(), into->devices.end(), fixes))
        throw ScenarioError(held.place + ": found '" + held.component + "', which has a " + device.type->key +
                            " itself; allowed: a part without one, or a ground");
    }
  }
}

/// A solver stated for the cell as a whole is also that of levels 2 and 3 if it comes from the command line,
/// or if the file has no section on contact and the cell begins with it. Explicit methods are never used for
/// contact: in a file they are those of the other levels, on the command line of a cell that begins with
/// contact they are refused.
void choose_solver(const YamlSource& source, Scenario& scenario) {
  Scenario::SolverKeys& given = scenario.solver_keys;
  const bool only = scenario.begins_with_contact() && !given.contact;
  const auto overridden = [&source](const char* key) { return source.overridden.count(key) != 0; };
  const bool no_contact = solver_is_explicit(scenario.solver);
  if (no_contact && overridden("solver.method") && scenario.begins_with_contact()) {
    std::string allowed;
    for (const std::string_view name : solver_names())
      if (!solver_is_explicit(name)) allowed.append(allowed.empty() ? "" : ", ").append(name);
    const std::string option = source.overridden.at("solver.method");
    throw ScenarioError(option + (option == "--set" ? ": solver.method" : "") + ": found '" +
                        scenario.solver + "'; allowed at level of detail 3: " + allowed +
                        ". Explicit methods cannot follow surface contact.");
  }
  const auto take_over = [&](Scenario::LevelSolver& own, bool all) {
    const bool fits = !no_contact || &own != &scenario.contact_solver;
    if (fits && (overridden("solver.method") || (all && given.method))) {
      own.method = scenario.solver;
      own.tolerance = scenario.tolerance;
    }
    if (overridden("solver.tolerance") || (all && given.tolerance)) own.tolerance = scenario.tolerance;
  };
  // Joints with aligned axes are stiff: the drive of each is made for the inertia of all that it turns.
  if (!given.method && !scenario.dynamics_solver && !scenario.robots.empty())
    scenario.dynamics_solver = Scenario::LevelSolver{"implicit", solver_default_tolerance("implicit"), {}};
  take_over(scenario.contact_solver, only);
  if (scenario.dynamics_solver) take_over(*scenario.dynamics_solver, false);
  given.contact = given.contact || overridden("solver.method") || overridden("solver.tolerance");
  if (overridden("solver.step_s")) {
    if (scenario.contact_solver.step_s) scenario.contact_solver.step_s = scenario.solver_step_s;
    if (scenario.dynamics_solver && scenario.dynamics_solver->step_s)
      scenario.dynamics_solver->step_s = scenario.solver_step_s;
  }
  const Scenario::LevelSolver* initial = scenario.initial_level_solver();
  scenario.step_s =
      initial != nullptr ? initial->step_s.value_or(scenario.solver_step_s) : scenario.solver_step_s;
}

/// Below `node`, whose key is `path`; `owner` is the name below a group such as parts.
void find_odd_angles(const YAML::Node& node, const std::string& path, const std::string& owner, int depth,
                     Scenario& scenario) {
  constexpr double kFullTurn = 2.0 * std::numbers::pi * (1.0 + 1e-9);
  for (const auto& entry : node) {
    const auto name = entry.first.as<std::string>(std::string());
    std::string key = path;
    if (!key.empty()) key += '.';
    key += name;
    const std::string& below = depth == 1 ? name : owner;
    if (entry.second.IsMap()) find_odd_angles(entry.second, key, below, depth + 1, scenario);
    if (name != "rpy_rad" || !entry.second.IsSequence()) continue;
    double largest = 0.0;
    for (const auto& angle : entry.second)
      if (std::abs(angle.as<double>(0.0)) > std::abs(largest)) largest = angle.as<double>(0.0);
    if (std::abs(largest) > kFullTurn) scenario.odd_angles.push_back({owner, key, largest});
  }
}

}  // namespace

void fail(const Scenario& scenario, const std::string& key, const std::string& found,
          const std::string& allowed) {
  throw ScenarioError(scenario.file.string() + ": " + key + ": found " + found + "; allowed: " + allowed);
}

Scenario read_scenario(const std::filesystem::path& file, const ScenarioOptions& options) {
  YamlSource source{file, {}};
  YAML::Node root = options.text ? parse_yaml_of(file, *options.text) : load_yaml(file);
  for (const std::string& text : options.overrides) apply_override(root, text, options, source);

  Scenario scenario;
  scenario.file = file;
  Fields f(source, root);
  describe(f, scenario);
  f.finish();
  check_names(f, scenario);
  check_holders(scenario);
  if (scenario.processes.empty()) scenario.processes.push_back({"cell", kMinLevelOfDetail, true, {}});
  if (options.level_of_detail) {
    const int level = *options.level_of_detail;
    if (level < kMinLevelOfDetail || level > kMaxLevelOfDetail) {
      throw ScenarioError("--lod: found " + std::to_string(level) + "; allowed: a whole number in [" +
                          std::to_string(kMinLevelOfDetail) + ", " + std::to_string(kMaxLevelOfDetail) + "]");
    }
    for (ScenarioProcess& process : scenario.processes) process.level_of_detail = level;
  }
  choose_solver(source, scenario);
  find_odd_angles(root, "", "", 0, scenario);
  return scenario;
}

std::optional<ScenarioHeading> read_heading(const std::filesystem::path& file) {
  const YAML::Node root = load_yaml(file);
  if (!root.IsMap() || !root["takt_scenario"].IsDefined()) return std::nullopt;
  const YamlSource source{file, {}};
  Fields f(source, root);
  ScenarioHeading heading;
  describe(f, heading);
  return heading;
}

}  // namespace takt
