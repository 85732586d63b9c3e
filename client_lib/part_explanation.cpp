#include "client_lib/part_explanation.h"

#include <nlohmann/json.hpp>

#include "client_lib/client.h"
#include "client_lib/reply_document.h"

namespace takt::client {
namespace {

using nlohmann::json;

/// Nothing is the empty name.
std::string name(const json& value) {
  return value.is_null() ? std::string() : value.get<std::string>();
}

Vector3 vector(const json& value) {
  return {value.at(0).get<double>(), value.at(1).get<double>(), value.at(2).get<double>()};
}

template <typename Enum>
Enum named(const json& value) {
  if (const auto found = enumerator_of<Enum>(value.get<std::string>())) return *found;
  throw ClientError(
      ClientError::Kind::refused,
      "The reply to explain_part holds '" + value.get<std::string>() + "', which this client does not know.");
}

PartExplanation::Contact contact(const json& value) {
  PartExplanation::Contact result;
  result.a = name(value.at("a"));
  result.b = name(value.at("b"));
  result.by_surface = value.value("surface_contact", false);
  result.measured = !value.at("distance").is_null();
  if (!result.measured) return result;
  result.distance_m = value.at("distance").get<double>();
  result.position_m = vector(value.at("position"));
  result.normal = vector(value.at("normal"));
  return result;
}

PartExplanation read(const std::string& text) {
  const json all = json::parse(text);
  PartExplanation e;
  e.document = text;
  e.part = name(all.at("part"));
  e.type = named<ComponentType>(all.at("type"));
  e.hierarchy = all.at("hierarchy").is_null() ? 0 : all.at("hierarchy").get<int>();
  e.state = named<PartState>(all.at("state"));
  e.state_because = name(all.at("state_because"));
  e.explanation = name(all.at("explanation"));
  e.time_s = all.at("time").get<double>();
  e.step = all.at("step").get<std::uint64_t>();
  e.epoch = all.at("epoch").get<std::uint32_t>();
  e.decided_at_s = all.at("decided_at").get<double>();
  e.partner = name(all.at("partner"));
  e.rule = name(all.at("rule"));
  e.contacts_to_partner = all.at("contacts_to_partner").get<int>();
  e.rival = name(all.at("rival"));
  e.contacts_to_rival = all.at("contacts_to_rival").get<int>();
  const json& since = all.at("since");
  e.since_s = since.at("time").get<double>();
  e.since_step = since.at("step").get<std::uint64_t>();
  e.partner_before = name(since.at("before"));
  e.sequences = all.at("sequences").get<std::vector<std::vector<std::string>>>();
  e.sequence_count = all.at("sequence_count").get<std::uint64_t>();
  for (const json& value : all.at("contacts")) e.contacts.push_back(contact(value));
  e.contact_count = all.at("contact_count").get<std::uint64_t>();
  for (const json& value : all.at("connections")) {
    e.connections.push_back({name(value.at("target")), vector(value.at("force")), vector(value.at("moment")),
                             vector(value.at("feed_forward")), value.at("softening").get<double>()});
  }
  e.surface_contact = all.at("surface_contact").get<bool>();
  for (const json& value : all.at("pressing")) {
    const auto number = [&value](const char* key) { return value.at(key).get<double>(); };
    e.pressing.push_back({name(value.at("by")), vector(value.at("force")), vector(value.at("torque")),
                          vector(value.at("center_of_pressure")), number("normal_force"),
                          number("friction_force"), number("area"), number("largest_pressure"),
                          number("largest_penetration")});
  }
  e.held = all.at("held").get<std::vector<std::string>>();
  e.held_count = all.at("held_count").get<std::uint64_t>();
  for (const auto& [component, value] : all.at("components").items()) {
    const json& hierarchy = value.at("hierarchy");
    e.components[component] = {named<ComponentType>(value.at("type")),
                               hierarchy.is_null() ? 0 : hierarchy.get<int>()};
  }
  return e;
}

}  // namespace

PartExplanation part_explanation(const std::map<std::string, std::string>& values) {
  try {
    return read(reply_document(values, "explain_part"));
  } catch (const ClientError&) {
    throw;
  } catch (const std::exception& error) {
    throw ClientError(ClientError::Kind::refused,
                      std::string("The reply to explain_part cannot be read: ") + error.what() + ".");
  }
}

}  // namespace takt::client
