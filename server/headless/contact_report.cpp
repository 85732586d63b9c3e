#include "server/headless/contact_report.h"

#include <nlohmann/json.hpp>

#include "client_lib/recording/message_json.h"
#include "server/messages/instant_messages.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

/// As the message takt_msgs/msg/Contact, with names.
Json contact_json(const CellDescription& cell, const ContactSample& sample) {
  Json contact = recording::message_json(to_message(sample), {});
  contact["base"] = cell.components[static_cast<std::size_t>(sample.base)].name;
  contact["target"] = cell.components[static_cast<std::size_t>(sample.target)].name;
  return contact;
}

}  // namespace

Json contacts_json(const CellDescription& cell, const Snapshot& state) {
  Json pairs = Json::array();
  for (const ContactSample& sample : state.contacts.pressing()) pairs.push_back(contact_json(cell, sample));
  return {{"pressing", state.contacts.count + state.contacts.omitted}, {"pairs", std::move(pairs)}};
}

Json contacts_json(const CellDescription& cell, const HeadlessResult& result) {
  Json all = contacts_json(cell, result.final_state);
  Json largest = Json::array();
  for (const ContactExtreme& extreme : result.contact_extremes) {
    Json item = contact_json(cell, extreme.sample);
    item["time"] = extreme.time_s;
    item["largest_torque"] = extreme.torque_N_m.value;
    item["largest_torque_time"] = extreme.torque_N_m.time_s;
    largest.push_back(std::move(item));
  }
  all["largest"] = std::move(largest);
  all["calls"] = {{"made", result.contact_counts.made},
                  {"skipped", result.contact_counts.skipped},
                  {"boxes_apart", result.contact_counts.boxes_apart},
                  {"rebuilds", result.contact_counts.rebuilds},
                  {"elements", result.contact_counts.elements}};
  return all;
}

void write_contact_header(std::ostream& out, const CellModel& model) {
  for (const ContactPairModel& pair : model.contact.pairs) {
    if (pair.force == PairForce::substitute) continue;
    for (const char* field :
         {"normal_force", "friction_force", "area", "largest_pressure", "largest_penetration"})
      out << ',' << model.components[static_cast<std::size_t>(pair.base)].name << '-'
          << model.components[static_cast<std::size_t>(pair.target)].name << '.' << field;
  }
}

void write_contacts(std::ostream& out, const CellModel& model, const ContactsSample& contacts) {
  auto next = contacts.pressing().begin();  // in the order of the pairs
  const auto end = contacts.pressing().end();
  for (const ContactPairModel& pair : model.contact.pairs) {
    ContactResult result;
    if (next != end && next->base == pair.base && next->target == pair.target) result = (next++)->result;
    if (pair.force == PairForce::substitute) continue;
    out << ',' << result.normal_force_N << ',' << result.friction_force_N << ',' << result.area_m2 << ','
        << result.largest_pressure_Pa << ',' << result.largest_penetration_m;
  }
}

}  // namespace takt
