#include "server/scenario/contact_fields.h"

#include <cmath>

namespace takt {

namespace {

StatedContact read_stated(YamlFields& fields) {
  StatedContact s;
  s.youngs_modulus_Pa = fields.number_if("youngs_modulus_Pa", positive("Pa"));
  s.poisson_ratio = fields.number_if("poisson_ratio", {.lower = 0.0, .upper = 0.499});
  s.layer_depth_m = fields.number_if("layer_depth_m", positive("m"));
  s.areal_damping_Ns_per_m3 = fields.number_if("areal_damping_Ns_per_m3", not_negative("N s/m^3"));
  s.damping_depth_m = fields.number_if("damping_depth_m", positive("m"));
  s.friction = fields.number_if("friction", not_negative(""));
  s.friction_velocity_m_per_s = fields.number_if("friction_velocity_m_per_s", positive("m/s"));
  s.tangential_stiffness_ratio = fields.number_if("tangential_stiffness_ratio", positive(""));
  s.tangential_damping_ratio = fields.number_if("tangential_damping_ratio", not_negative(""));
  if (fields.has("friction_law")) {
    const std::string law = fields.choice("friction_law", {"regularised", "stick"}, "regularised");
    s.friction_law = law == "stick" ? FrictionLaw::stick : FrictionLaw::regularised;
  }
  return s;
}

ScenarioContactComponent read_component(YamlFields fields, const std::string& name) {
  ScenarioContactComponent component;
  component.name = name;
  component.place = fields.path();
  component.stated = read_stated(fields);
  component.element_edge_m = fields.number_if("element_edge_m", not_negative("m"));
  const std::string role = fields.choice("role", {"by_rule", "base", "target"}, "by_rule");
  component.role = role == "base"     ? ContactRole::base
                   : role == "target" ? ContactRole::target
                                      : ContactRole::by_rule;
  fields.finish();
  return component;
}

std::vector<std::array<double, 2>> read_friction_table(YamlFields& fields) {
  const char* key = "friction_at_degC";
  const char* allowed =
      "a list of [degC, friction] with rising temperatures and friction >= 0, e.g. [[20, 30], [280, 0.6]]";
  std::vector<std::array<double, 2>> table;
  const YAML::Node rows = fields.optional(key);
  if (!rows.IsDefined()) return table;
  if (!rows.IsSequence() || rows.size() == 0) fields.fail(key, describe(rows), allowed);
  for (const YAML::Node& row : rows) {
    std::array<double, 2> entry{};
    bool good = row.IsSequence() && row.size() == 2;
    for (std::size_t i = 0; good && i < 2; ++i)
      good = row[i].IsScalar() && YAML::convert<double>::decode(row[i], entry[i]) && std::isfinite(entry[i]);
    if (!good || entry[1] < 0.0 || (!table.empty() && entry[0] <= table.back()[0]))
      fields.fail_at(row, key, describe(row), allowed);
    table.push_back(entry);
  }
  return table;
}

ScenarioContactPair read_pair(YamlFields& fields) {
  ScenarioContactPair pair;
  const char* allowed = "two names, e.g. [P, Table1]; * stands for any characters";
  const YAML::Node names = fields.required("pair", allowed);
  if (!names.IsSequence() || names.size() != 2) fields.fail("pair", describe(names), allowed);
  for (std::size_t i = 0; i < 2; ++i) {
    if (!names[i].IsScalar() || names[i].Scalar().empty())
      fields.fail_at(names[i], "pair", describe(names[i]), allowed);
    pair.pair[i] = names[i].Scalar();
  }
  pair.place = fields.place_of(names, "pair");
  pair.stated = read_stated(fields);
  if (fields.has("interaction")) {
    const std::string force = fields.choice("interaction", {"contact", "substitute"}, "contact");
    pair.interaction = force == "contact" ? PairForce::contact : PairForce::substitute;
  }
  pair.friction_at_degC = read_friction_table(fields);
  pair.base = fields.text_or("base", "");
  if (!pair.base.empty() && pair.base != pair.pair[0] && pair.base != pair.pair[1])
    fields.fail("base", "'" + pair.base + "'", "one of the two names of the pair");
  fields.finish();
  return pair;
}

}  // namespace

void read_contact(YamlFields& root, const YamlSource& source, Scenario& scenario) {
  ScenarioContact& contact = scenario.contact;
  contact.given = root.has("contact");
  YamlFields section = root.mapping("contact");
  const auto stated = [&section](const char* key) {
    YamlFields fields = section.mapping(key);
    const StatedContact result = read_stated(fields);
    fields.finish();
    return result;
  };
  contact.defaults = stated("defaults");
  contact.grippers = stated("grippers");
  contact.element_edge_m = section.number_if("element_edge_m", not_negative("m"));
  contact.optimize_calls = section.boolean_or("optimize_calls", contact.optimize_calls);
  contact.parallel = section.boolean_or("parallel", contact.parallel);
  YamlFields sleeping = section.mapping("sleeping");
  contact.sleeping.enabled = sleeping.boolean_or("enabled", contact.sleeping.enabled);
  contact.sleeping.speed_m_per_s =
      sleeping.number_or("speed_m_per_s", positive("m/s"), contact.sleeping.speed_m_per_s);
  contact.sleeping.after_s = sleeping.number_or("after_s", not_negative("s"), contact.sleeping.after_s);
  sleeping.finish();
  for (auto& [name, fields] : section.entries("components"))
    contact.components.push_back(read_component(fields, name));
  const YAML::Node pairs = section.optional("pairs");
  if (pairs.IsDefined() && !pairs.IsNull()) {
    if (!pairs.IsSequence()) section.fail("pairs", describe(pairs), "a list of {pair: [NAME, NAME], ...}");
    for (const YAML::Node& node : pairs) {
      YamlFields fields(source, node, "contact.pairs");
      contact.pairs.push_back(read_pair(fields));
    }
  }
  section.finish();
}

}  // namespace takt
