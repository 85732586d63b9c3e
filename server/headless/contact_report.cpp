#include "server/headless/contact_report.h"

#include <nlohmann/json.hpp>

#include "server/headless/vector_json.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

Json contact_json(const CellDescription& cell, const ContactSample& sample) {
  const auto name = [&](int component) { return cell.components[static_cast<std::size_t>(component)].name; };
  return {{"base", name(sample.base)},
          {"target", name(sample.target)},
          {"force_on_base_N", vector_json(sample.F_base_W.f)},
          {"torque_on_base_N_m", vector_json(sample.F_base_W.t)},
          {"center_of_pressure_m", vector_json(sample.p_WC)},
          {"elements", sample.result.elements},
          {"area_m2", sample.result.area_m2},
          {"normal_force_N", sample.result.normal_force_N},
          {"friction_force_N", sample.result.friction_force_N},
          {"largest_pressure_Pa", sample.result.largest_pressure_Pa},
          {"largest_penetration_m", sample.result.largest_penetration_m}};
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
    item["time_s"] = extreme.time_s;
    item["largest_torque_N_m"] = extreme.torque_N_m.value;
    item["largest_torque_time_s"] = extreme.torque_N_m.time_s;
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
