#include "server/scenario/assertion_fields.h"

#include <algorithm>
#include <numbers>

#include "idl/common/text.h"
#include "server/scenario/device_builder.h"

namespace takt {

namespace {

using Kind = ScenarioAssertion::Kind;

template <class Items>
void add_names(const Items& items, std::vector<std::string>& names) {
  for (const auto& item : items) names.push_back(item.name);
}

std::string known_name(YamlFields& fields, const std::string& key, const std::vector<std::string>& names,
                       const char* what) {
  const std::string name = fields.text(key);
  if (std::find(names.begin(), names.end(), name) != names.end()) return name;
  fields.fail(key, "'" + name + "'", std::string(what) + " of this scenario: " + list_names(names));
}

void read_limits(YamlFields& fields, const char* unit, ScenarioAssertion& assertion) {
  const std::optional<double> above = fields.number_if("above", {.unit = unit});
  const std::optional<double> below = fields.number_if("below", {.unit = unit});
  if (!above && !below) fields.fail("below", "neither 'above' nor 'below'", "at least one of them, a number");
  if (above) assertion.lower = *above;
  if (below) assertion.upper = *below;
  if (assertion.lower > assertion.upper)
    fields.fail("above", "more than 'below'", "an interval that is not empty");
}

void read_pair(YamlFields& fields, ScenarioAssertion& assertion) {
  const char* allowed = "two names, e.g. [Motor, Housing]; * stands for any characters";
  const YAML::Node names = fields.required("pair", allowed);
  if (!names.IsSequence() || names.size() != 2 || !names[0].IsScalar() || !names[1].IsScalar())
    fields.fail("pair", describe(names), allowed);
  for (std::size_t i = 0; i < 2; ++i) assertion.pair[i] = names[i].Scalar();
}

void read_pose(YamlFields& fields, ScenarioAssertion& assertion) {
  assertion.X_WB = fields.pose_or_identity("pose");
  assertion.tolerance_m = fields.number("tolerance_m", positive("m"));
  const std::optional<double> angle = fields.number_if("tolerance_deg", positive("deg"));
  if (angle) assertion.tolerance_rad = *angle * std::numbers::pi / 180.0;
}

ScenarioAssertion read_assertion(YamlFields fields, const std::string& name, const Scenario& scenario) {
  ScenarioAssertion assertion;
  assertion.name = name;
  assertion.place = fields.path();
  const std::string kind = fields.choice(
      "check", {"contact_force", "pose", "held_by", "energy", "signal", "grip_margin", "no_collision"}, "");
  std::vector<std::string> parts, robots, grippers, devices, components;
  add_names(scenario.parts, parts);
  add_names(scenario.robots, robots);
  add_names(scenario.furnaces, devices);
  for (const ScenarioPart& part : scenario.parts)
    if (part.heat) devices.push_back(heat_device_name(part.name));
  components = parts;
  add_names(scenario.grounds, components);
  add_names(scenario.grippers, components);
  add_names(scenario.grippers, grippers);
  if (fields.has("time_s")) assertion.time_s = fields.number("time_s", {.lower = 0.0, .unit = "s"});
  if (kind == "contact_force") {
    assertion.kind = Kind::contact_force;
    read_pair(fields, assertion);
    read_limits(fields, "N", assertion);
  } else if (kind == "pose") {
    assertion.kind = Kind::pose;
    assertion.subject = known_name(fields, "part", parts, "a part");
    read_pose(fields, assertion);
  } else if (kind == "held_by") {
    assertion.kind = Kind::held_by;
    assertion.subject = known_name(fields, "part", parts, "a part");
    if (fields.text("by") != "nothing")
      assertion.holder = known_name(fields, "by", components, "a component");
  } else if (kind == "energy") {
    assertion.kind = Kind::energy;
    std::vector<std::string> consumers = robots;
    add_names(scenario.furnaces, consumers);
    assertion.subject = known_name(fields, "of", consumers, "a robot or device that draws energy");
    read_limits(fields, "J", assertion);
  } else if (kind == "signal") {
    assertion.kind = Kind::signal;
    assertion.subject = known_name(fields, "device", devices, "a device");
    assertion.signal = fields.text("signal");
    read_limits(fields, "", assertion);
  } else if (kind == "grip_margin") {
    assertion.kind = Kind::grip_margin;
    assertion.subject = known_name(fields, "gripper", grippers, "a gripper");
    read_limits(fields, "", assertion);
  } else {
    assertion.kind = Kind::no_collision;
    if (!scenario.collision_checking.enabled)
      fields.fail("check", "no_collision", "this check together with a section collision_checking");
  }
  fields.finish();
  return assertion;
}

}  // namespace

void read_assertions(YamlFields& top, Scenario& scenario) {
  for (auto& [name, fields] : top.entries("assertions"))
    scenario.assertions.push_back(read_assertion(fields, name, scenario));
}

}  // namespace takt
