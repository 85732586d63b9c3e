#include "server/runtime/requests/entity_requests.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "idl/common/glob.h"
#include "idl/common/text.h"
#include "server/runtime/requests/document_reply.h"

namespace takt {
namespace {

using Parsed = std::variant<ControlAction, ControlReply>;

std::string_view category(ComponentType type) {
  switch (type) {
    case ComponentType::part:
      return "part";
    case ComponentType::gripper:
      return "gripper";
    case ComponentType::ground:
      return "ground";
  }
  return "unknown";
}

std::string numbers(const Vec3& v) {
  return exact_text(v.x()) + " " + exact_text(v.y()) + " " + exact_text(v.z());
}

Parsed parse_list(const ControlRequest& request) {
  RequestArguments arguments(request, {"filter", "category"});
  GetEntities action;
  if (const std::string* filter = arguments.find("filter")) action.filter = *filter;
  if (const std::string* category = arguments.find("category")) {
    if (*category != "part" && *category != "gripper" && *category != "ground")
      arguments.fail_value("category", category, "part, gripper or ground");
    action.category = *category;
  }
  return arguments.result<ControlAction>(action);
}

Parsed parse_state(const ControlRequest& request, const CellDescription& cell) {
  RequestArguments arguments(request, {"entity"});
  const std::string name = arguments.text("entity", "the component whose state is asked for.");
  const int component = cell.find_component(name);
  const auto result = arguments.result<ControlAction>(GetEntityState{component});
  if (component >= 0 || std::holds_alternative<ControlReply>(result)) return result;
  return no_component_reply(request.id, name, cell);
}

Parsed parse_set_state(const ControlRequest& request, const CellDescription& cell) {
  RequestArguments arguments(request,
                             {"entity", "position", "orientation", "linear_velocity", "angular_velocity"});
  const std::string name = arguments.text("entity", "the Part to put elsewhere.");
  SetEntityState action;
  action.component = cell.find_component(name);
  const GivenPose pose = read_pose(arguments);
  action.p_WB = pose.p;
  action.R_WB = pose.R;
  Vec3 v = Vec3::Zero();
  if (arguments.reals("linear_velocity", {&v.x(), &v.y(), &v.z()})) action.linear_velocity = v;
  if (arguments.reals("angular_velocity", {&v.x(), &v.y(), &v.z()})) action.angular_velocity = v;
  if (!action.p_WB && !action.R_WB && !action.linear_velocity && !action.angular_velocity) {
    arguments.fail("needs a position, an orientation, a linear_velocity or an angular_velocity.");
  }
  auto result = arguments.result<ControlAction>(action);
  if (action.component >= 0 || std::holds_alternative<ControlReply>(result)) return result;
  return no_component_reply(request.id, name, cell);
}

Parsed parse_attach(const ControlRequest& request, const CellDescription& cell) {
  RequestArguments arguments(request, {"part", "to"});
  const std::string part = arguments.text("part", "the Part to attach.");
  const std::string to = arguments.text("to", "the component it is to hang on.");
  const Attach action{cell.find_component(part), cell.find_component(to)};
  auto result = arguments.result<ControlAction>(action);
  if (std::holds_alternative<ControlReply>(result)) return result;
  if (action.part < 0) return no_component_reply(request.id, part, cell);
  if (action.to < 0) return no_component_reply(request.id, to, cell);
  return result;
}

Parsed parse_detach(const ControlRequest& request, const CellDescription& cell) {
  RequestArguments arguments(request, {"part"});
  const std::string part = arguments.text("part", "the Part to let go.");
  const Detach action{cell.find_component(part)};
  auto result = arguments.result<ControlAction>(action);
  if (action.part >= 0 || std::holds_alternative<ControlReply>(result)) return result;
  return no_component_reply(request.id, part, cell);
}

}  // namespace

std::optional<Parsed> parse_entity_request(const ControlRequest& request, const CellDescription& cell) {
  const std::string& name = request.request;
  if (name == "get_entities") return parse_list(request);
  if (name == "get_entity_state") return parse_state(request, cell);
  if (name == "set_entity_state") return parse_set_state(request, cell);
  if (name == "attach") return parse_attach(request, cell);
  if (name == "detach") return parse_detach(request, cell);
  return std::nullopt;
}

GivenPose read_pose(RequestArguments& arguments) {
  GivenPose pose;
  Vec3 p = Vec3::Zero();
  if (arguments.reals("position", {&p.x(), &p.y(), &p.z()})) pose.p = p;
  Quat q = Quat::Identity();
  if (arguments.reals("orientation", {&q.x(), &q.y(), &q.z(), &q.w()})) {
    constexpr double kMaxDeviation = 1e-3;
    if (!(std::abs(q.norm() - 1.0) <= kMaxDeviation)) {
      arguments.fail_value("orientation", arguments.find("orientation"),
                           "a quaternion x y z w of length 1, within 0.001");
    } else {
      pose.R = q.normalized().toRotationMatrix();
    }
  }
  return pose;
}

ControlReply no_component_reply(std::uint64_t id, const std::string& name, const CellDescription& cell) {
  constexpr std::size_t kLongestList = 600;  // of the 1024 characters of a message
  std::string known;
  for (const ComponentDescription& c : cell.components) {
    if (known.size() + c.name.size() > kLongestList) {
      known += ", ...";
      break;
    }
    known += (known.empty() ? "" : ", ") + c.name;
  }
  return {id,
          ControlResult::not_found,
          "There is no component '" + name.substr(0, 128) + "' in this cell; it has " + known + ".",
          {}};
}

ControlReply entities_reply(std::uint64_t id, const GetEntities& request, const CellDescription& cell) {
  using nlohmann::json;
  json list = json::array();
  for (const ComponentDescription& c : cell.components) {
    if (!request.filter.empty() && !glob_match(request.filter, c.name)) continue;
    if (!request.category.empty() && request.category != category(c.type)) continue;
    const bool part = c.type == ComponentType::part;
    list.push_back({{"name", c.name},
                    {"category", category(c.type)},
                    {"hierarchy", part ? json(c.hierarchy) : json()},
                    {"mass", part ? json(c.mass_kg) : json()}});
  }
  ControlReply reply{id,
                     ControlResult::ok,
                     std::to_string(list.size()) + " of " + std::to_string(cell.components.size()) +
                         " components are as asked for.",
                     {{"count", std::to_string(list.size())}}};
  if (!add_document(reply, list.dump(-1, ' ', false, json::error_handler_t::replace))) {
    reply.result = ControlResult::failed;
    reply.message += " The list does not fit into one reply; ask for fewer with a filter.";
  }
  return reply;
}

ControlReply entity_state_reply(std::uint64_t id, int component, const Snapshot& snapshot,
                                const CellDescription& cell) {
  const auto index = static_cast<std::size_t>(component);
  const ComponentSample& sample = snapshot.components[index];
  const Quat& q = sample.q_WB;
  const std::string partner =
      sample.partner < 0 ? "" : cell.components[static_cast<std::size_t>(sample.partner)].name;
  const std::string& name = cell.components[index].name;
  return {id,
          ControlResult::ok,
          name + " is " + std::string(to_string(sample.state)) +
              (partner.empty() ? "" : ", held by " + partner) + ".",
          {{"entity", name},
           {"category", std::string(category(cell.components[index].type))},
           {"position", numbers(sample.p_WB)},
           {"orientation",
            exact_text(q.x()) + " " + exact_text(q.y()) + " " + exact_text(q.z()) + " " + exact_text(q.w())},
           {"linear_velocity", numbers(sample.V_WB.v)},
           {"angular_velocity", numbers(sample.V_WB.w)},
           {"state", std::string(to_string(sample.state))},
           {"partner", partner},
           {"time", exact_text(snapshot.time_s)},
           {"step", std::to_string(snapshot.step)},
           {"epoch", std::to_string(snapshot.epoch)}}};
}

}  // namespace takt
