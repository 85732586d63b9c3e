#include "server/runtime/requests/explain_reply.h"

#include <nlohmann/json.hpp>

#include "server/runtime/requests/document_reply.h"

namespace takt {
namespace {

using nlohmann::json;

json json_of(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

/// Names components, and remembers which.
class Names {
 public:
  explicit Names(const CellDescription& cell) : cell_(cell), used_(cell.components.size(), 0) {}

  json operator()(int component) {
    if (component < 0) return nullptr;
    used_[static_cast<std::size_t>(component)] = 1;
    return cell_.components[static_cast<std::size_t>(component)].name;
  }
  json operator()(const std::vector<int>& components) {
    json list = json::array();
    for (const int component : components) list.push_back((*this)(component));
    return list;
  }
  json hierarchy(int component) const {
    const ComponentDescription& c = cell_.components[static_cast<std::size_t>(component)];
    return c.type == ComponentType::part ? json(c.hierarchy) : json();
  }
  json used() const {
    json all = json::object();
    for (std::size_t i = 0; i < used_.size(); ++i) {
      if (used_[i] == 0) continue;
      const ComponentDescription& c = cell_.components[i];
      all[c.name] = {{"type", to_string(c.type)}, {"hierarchy", hierarchy(static_cast<int>(i))}};
    }
    return all;
  }

 private:
  const CellDescription& cell_;
  std::vector<char> used_;
};

json contacts(const Explanation& e, Names& name) {
  json list = json::array();
  for (const ExplainedContact& contact : e.contacts) {
    json entry{{"a", name(contact.a)},
               {"b", name(contact.b)},
               {"distance", nullptr},
               {"error", nullptr},
               {"position", nullptr},
               {"normal", nullptr},
               {"surface_contact", contact.by_surface}};
    if (contact.depth.known) {
      entry["distance"] = contact.depth.distance_m;
      entry["error"] = contact.depth.error_m;
      entry["position"] = json_of(contact.depth.position_W);
      entry["normal"] = json_of(contact.depth.normal_W);
    }
    list.push_back(std::move(entry));
  }
  return list;
}

json pressing(const Explanation& e, Names& name) {
  json list = json::array();
  for (const ContactSample& pair : e.pressing) {
    const bool is_base = pair.base == e.component;
    const double sign = is_base ? 1.0 : -1.0;
    list.push_back({{"by", name(is_base ? pair.target : pair.base)},
                    {"force", json_of(sign * pair.F_base_W.f)},
                    {"torque", json_of(sign * pair.F_base_W.t)},
                    {"center_of_pressure", json_of(pair.p_WC)},
                    {"elements", pair.result.elements},
                    {"area", pair.result.area_m2},
                    {"normal_force", pair.result.normal_force_N},
                    {"friction_force", pair.result.friction_force_N},
                    {"largest_pressure", pair.result.largest_pressure_Pa},
                    {"largest_penetration", pair.result.largest_penetration_m}});
  }
  return list;
}

json document(const Explanation& e, const CellDescription& cell) {
  Names name(cell);
  json sequences = json::array();
  for (const std::vector<int>& sequence : e.sequences.sequences) sequences.push_back(name(sequence));
  json connections = json::array();
  for (const ExplainedConnection& c : e.connections) {
    connections.push_back({{"target", name(c.target)},
                           {"force", json_of(c.on_base_W.f)},
                           {"moment", json_of(c.on_base_W.t)},
                           {"feed_forward", json_of(c.feed_forward_W)},
                           {"softening", c.softening}});
  }
  json all{{"part", name(e.component)},
           {"type", to_string(e.type)},
           {"hierarchy", name.hierarchy(e.component)},
           {"state", to_string(e.state)},
           {"state_because", name(e.state_because)},
           {"explanation", describe(e, cell)},
           {"time", e.time_s},
           {"step", e.step},
           {"epoch", e.epoch},
           {"decided_at", e.decided_at_s},
           {"partner", name(e.decision.partner)},
           {"rule", e.type == ComponentType::part ? json(to_string(e.decision.rule)) : json()},
           {"contacts_to_partner", e.decision.contacts},
           {"rival", name(e.decision.rival)},
           {"contacts_to_rival", e.decision.rival_contacts},
           {"since", {{"time", e.since.time_s}, {"step", e.since.step}, {"before", name(e.since.before)}}},
           {"sequence_count", e.sequences.count},
           {"sequences", std::move(sequences)},
           {"contact_count", e.contact_count},
           {"contacts", contacts(e, name)},
           {"connections", std::move(connections)},
           {"surface_contact", e.surface_contact},
           {"pressing", pressing(e, name)},
           {"held_count", e.held_count},
           {"held", name(e.held)}};
  all["components"] = name.used();
  return all;
}

}  // namespace

ControlReply explanation_reply(std::uint64_t id, const Explanation& explanation,
                               const CellDescription& cell) {
  // A name that is not UTF-8 must not end the loop: what cannot be told is replaced.
  const std::string text = document(explanation, cell).dump(-1, ' ', false, json::error_handler_t::replace);
  ControlReply reply{id, ControlResult::ok, describe(explanation, cell), {}};
  if (!add_document(reply, text)) {
    reply.result = ControlResult::failed;
    reply.message += " (The details do not fit into one reply: the names of the components are too long.)";
  }
  return reply;
}

}  // namespace takt
