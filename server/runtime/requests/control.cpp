#include "server/runtime/requests/control.h"

#include "idl/common/glob.h"
#include "idl/common/text.h"
#include "server/simulation/model/command.h"

namespace takt {
namespace {

template <typename Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

std::vector<std::string> known_names(std::string_view kind, const CellDescription& cell) {
  if (kind == "component") return names_of(cell.components);
  if (kind == "process") {
    std::vector<std::string> names = names_of(cell.processes);
    names.insert(names.begin(), "all");
    return names;
  }
  std::vector<std::string> names;
  for (int target = 0; target < target_count(cell); ++target) names.emplace_back(target_name(cell, target));
  return names;
}

takt_msgs::msg::Vector3 vector_of(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

std::variant<requests::Any, Refusal> parse(const ControlRequest& request, const CellDescription* cell) {
  requests::Any parsed;
  KnownNames known;
  if (cell != nullptr) known = [cell](std::string_view kind) { return known_names(kind, *cell); };
  if (auto fault = read_request(request.request, request.arguments, parsed, known))
    return Refusal{fault->result, std::move(fault->sentence)};
  return parsed;
}

ControlRequest control_request(const requests::Any& request) {
  return std::visit(
      []<typename Type>(const Type& typed) {
        return ControlRequest{0, std::string(request_info<Type>().name), arguments_of(typed)};
      },
      request);
}

requests::GetFeaturesResponse features() {
  requests::GetFeaturesResponse response;
  for (const RequestInfo* request : requests::kAll) response.requests.emplace_back(request->name);
  for (const EnumeratorInfo& pace : kEnumeration<Pace>.enumerators) response.paces.emplace_back(pace.name);
  response.reset_scopes = {0, 1, 2, 4, 255};
  response.levels_of_detail = {1, 2, 3};
  response.spawn_formats = {"obj", "stl", "glb"};
  response.interface = "simulation_interfaces 2.1";
  return response;
}

Outcome<requests::GetEntities> entities(const requests::GetEntities& request, const CellDescription& cell,
                                        const EntityInfos& infos) {
  requests::GetEntitiesResponse response;
  for (const ComponentDescription& c : cell.components) {
    if (!request.filter.empty() && !glob_match(request.filter, c.name)) continue;
    if (request.type && *request.type != c.type) continue;
    response.entities.push_back(infos.of(c));
  }
  return {std::to_string(response.entities.size()) + " of " + std::to_string(cell.components.size()) +
              " components are as asked for.",
          std::move(response)};
}

Outcome<requests::GetEntityState> entity_state(int component, const Snapshot& snapshot,
                                               const CellDescription& cell) {
  const auto index = static_cast<std::size_t>(component);
  const ComponentSample& sample = snapshot.components[index];
  const Quat& q = sample.q_WB;
  requests::GetEntityStateResponse state;
  state.entity = cell.components[index].name;
  state.type = cell.components[index].type;
  state.position = vector_of(sample.p_WB);
  state.orientation = {q.x(), q.y(), q.z(), q.w()};
  state.linear_velocity = vector_of(sample.V_WB.v);
  state.angular_velocity = vector_of(sample.V_WB.w);
  state.state = sample.state;
  if (sample.partner >= 0) state.partner = cell.components[static_cast<std::size_t>(sample.partner)].name;
  state.time = snapshot.time_s;
  state.step = snapshot.step;
  state.epoch = snapshot.epoch;
  return {state.entity + " is " + std::string(to_string(state.state)) +
              (state.partner ? ", held by " + *state.partner : "") + ".",
          std::move(state)};
}

namespace {

/// Names components, and remembers which.
class Names {
 public:
  explicit Names(const CellDescription& cell) : cell_(cell), used_(cell.components.size(), 0) {}

  std::string operator()(int component) {
    used_[static_cast<std::size_t>(component)] = 1;
    return cell_.components[static_cast<std::size_t>(component)].name;
  }
  std::optional<std::string> if_any(int component) {
    return component < 0 ? std::nullopt : std::optional((*this)(component));
  }
  std::vector<std::string> operator()(const std::vector<int>& components) {
    std::vector<std::string> names;
    for (const int component : components) names.push_back((*this)(component));
    return names;
  }
  std::optional<std::int32_t> hierarchy(int component) const {
    const ComponentDescription& c = cell_.components[static_cast<std::size_t>(component)];
    return c.type == ComponentType::part ? std::optional(c.hierarchy) : std::nullopt;
  }
  std::vector<requests::ExplainedComponent> used() const {
    std::vector<requests::ExplainedComponent> all;
    for (std::size_t i = 0; i < used_.size(); ++i)
      if (used_[i] != 0)
        all.push_back({cell_.components[i].name, cell_.components[i].type, hierarchy(static_cast<int>(i))});
    return all;
  }

 private:
  const CellDescription& cell_;
  std::vector<char> used_;
};

requests::ExplainedContact contact_of(const ExplainedContact& contact, Names& name) {
  requests::ExplainedContact explained{.a = name(contact.a), .b = name(contact.b)};
  explained.surface_contact = contact.by_surface;
  explained.measured = contact.depth.known;
  if (!explained.measured) return explained;
  explained.distance = contact.depth.distance_m;
  explained.error = contact.depth.error_m;
  explained.position = vector_of(contact.depth.position_W);
  explained.normal = vector_of(contact.depth.normal_W);
  return explained;
}

requests::ExplainedPressure pressure_of(const ContactSample& pair, int component, Names& name) {
  const bool is_base = pair.base == component;
  return {resultant_of(pair, is_base ? 1.0 : -1.0), name(is_base ? pair.target : pair.base)};
}

}  // namespace

takt_msgs::msg::ContactResultant resultant_of(const ContactSample& pair, double sign) {
  return {vector_of(sign * pair.F_base_W.f),
          vector_of(sign * pair.F_base_W.t),
          vector_of(pair.p_WC),
          static_cast<std::uint32_t>(pair.result.elements),
          pair.result.area_m2,
          pair.result.normal_force_N,
          pair.result.friction_force_N,
          pair.result.largest_pressure_Pa,
          pair.result.largest_penetration_m};
}

Outcome<requests::ExplainPart> explanation(const Explanation& e, const CellDescription& cell) {
  Names name(cell);
  requests::ExplainPartResponse explained;
  explained.part = name(e.component);
  explained.type = e.type;
  explained.hierarchy = name.hierarchy(e.component);
  explained.state = e.state;
  explained.state_because = name.if_any(e.state_because);
  explained.explanation = describe(e, cell);
  explained.time = e.time_s;
  explained.step = e.step;
  explained.epoch = e.epoch;
  explained.decided_at = e.decided_at_s;
  explained.partner = name.if_any(e.decision.partner);
  if (e.type == ComponentType::part) explained.rule = e.decision.rule;
  explained.contacts_to_partner = e.decision.contacts;
  explained.rival = name.if_any(e.decision.rival);
  explained.contacts_to_rival = e.decision.rival_contacts;
  explained.since = e.since.time_s;
  explained.since_step = e.since.step;
  explained.partner_before = name.if_any(e.since.before);
  explained.sequence_count = e.sequences.count;
  for (const std::vector<int>& sequence : e.sequences.sequences)
    explained.sequences.push_back({name(sequence)});
  explained.contact_count = e.contact_count;
  for (const ExplainedContact& contact : e.contacts) explained.contacts.push_back(contact_of(contact, name));
  for (const ExplainedConnection& c : e.connections)
    explained.connections.push_back({name(c.target), vector_of(c.on_base_W.f), vector_of(c.on_base_W.t),
                                     vector_of(c.feed_forward_W), c.softening});
  explained.surface_contact = e.surface_contact;
  for (const ContactSample& pair : e.pressing)
    explained.pressing.push_back(pressure_of(pair, e.component, name));
  explained.held_count = e.held_count;
  explained.held = name(e.held);
  explained.components = name.used();
  return {explained.explanation, std::move(explained)};
}

}  // namespace takt
