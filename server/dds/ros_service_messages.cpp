#include "server/dds/ros_service_messages.h"

#include <regex.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>

#include "idl/common/frames.h"
#include "idl/common/stamp.h"
#include "idl/common/text.h"
#include "idl/common/utf8.h"

namespace takt::ros {
namespace {

namespace msg = simulation_interfaces::msg;

// Of SimulatorFeatures.msg.
enum Feature : std::uint16_t {
  kSpawning = 0,
  kDeleting = 1,
  kEntityBounds = 5,
  kEntityCategories = 8,
  kEntityStateGetting = 10,
  kEntityStateSetting = 11,
  kEntityInfoGetting = 12,
  kReset = 20,
  kResetTime = 21,
  kResetState = 22,
  kResetSpawned = 23,
  kStateGetting = 24,
  kStateSetting = 25,
  kPause = 26,
  kStepSingle = 31,
  kStepMultiple = 32,
  kStepAction = 33,
  kWorldLoading = 40,
  kWorldUnloading = 43,
  kSpawningEntities = 50,
};
// Of EntityCategory.msg.
enum Category : std::uint8_t { kObject = 0, kRobot = 1, kStaticObject = 5 };

template <Request Type>
Question plain(const Type& request) {
  return Asked{control_request(request), {}};
}

/// std::nullopt if the request was refused.
template <typename Response>
std::optional<Response> response_of(const ControlReply& reply) {
  Response response;
  if (reply.result != ControlResult::ok || read_arguments({}, reply.values, response)) return std::nullopt;
  return response;
}

takt_msgs::msg::Vector3 vector_of(const auto& v) {
  return {v.x, v.y, v.z};
}
/// All zeros stand for a missing orientation.
takt_msgs::msg::Quaternion orientation_of(const geometry_msgs::msg::Pose& pose) {
  const auto& q = pose.orientation;
  if (q.x == 0.0 && q.y == 0.0 && q.z == 0.0 && q.w == 0.0) return {};
  return {q.x, q.y, q.z, q.w};
}
bool is_world(const std::string& frame) {
  return frame.empty() || frame == kWorldFrame;
}
Question wrong_frame(const std::string& frame) {
  return Refusal{ControlResult::unsupported, "The frame '" + frame.substr(0, 100) +
                                                 "' is not known here; poses are in the frame 'world'."};
}

std::uint8_t category_number(ComponentType type) {
  return type == ComponentType::part ? kObject : type == ComponentType::gripper ? kRobot : kStaticObject;
}

/// Lines: the expression, then the digits of the categories.
std::string filter_note(const msg::EntityFilters& filters) {
  std::string note = filters.filter + "\n";
  for (const auto& category : filters.categories) note += static_cast<char>('0' + category.category % 10);
  return note;
}

class Expression {
 public:
  explicit Expression(const std::string& pattern) {
    good_ = regcomp(&compiled_, pattern.c_str(), REG_EXTENDED | REG_NOSUB) == 0;
  }
  ~Expression() {
    if (good_) regfree(&compiled_);
  }
  Expression(const Expression&) = delete;
  Expression& operator=(const Expression&) = delete;
  bool good() const { return good_; }
  bool matches(const std::string& name) const {
    return regexec(&compiled_, name.c_str(), 0, nullptr, 0) == 0;
  }

 private:
  regex_t compiled_{};
  bool good_ = false;
};

/// The entities that a filter_note() means.
class Choice {
 public:
  explicit Choice(const std::string& note)
      : split_(note.find('\n')), expression_(note.substr(0, split_)), categories_(note.substr(split_ + 1)) {}
  bool has(const std::string& name, ComponentType type) const {
    const char category = static_cast<char>('0' + category_number(type));
    if (!categories_.empty() && categories_.find(category) == std::string::npos) return false;
    return split_ == 0 || (expression_.good() && expression_.matches(name));
  }

 private:
  std::size_t split_;
  Expression expression_;
  std::string categories_;
};

msg::Result result_with(ControlResult result, std::string message = {}) {
  return {static_cast<std::uint8_t>(result), std::move(message)};
}

/// Index of the entity, or -1 with the result that says so.
int find_entity(const Instant& now, const std::string& name, msg::Result& result) {
  if (now.cell == nullptr) {
    result = result_with(ControlResult::incorrect_state, "No scenario is loaded.");
    return -1;
  }
  const int found = now.cell->find_component(name);
  result = found >= 0 ? result_with(ControlResult::ok)
                      : result_with(ControlResult::not_found, "There is no entity '" +
                                                                  utf8_sanitize(name, 60) + "'; there are " +
                                                                  list_names(now.cell->components) + ".");
  return found;
}

geometry_msgs::msg::Vector3 ros_vector(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

void answer(const Instant& now, const srv::GetEntitiesStates_Request& request,
            srv::GetEntitiesStates_Response& response) {
  const Question question = ask(srv::GetEntities_Request{request.filters});
  if (const auto* refusal = std::get_if<Refusal>(&question)) {
    response.result = result_with(refusal->result, refusal->message);
    return;
  }
  if (now.cell == nullptr) {
    response.result = result_with(ControlResult::incorrect_state, "No scenario is loaded.");
    return;
  }
  response.result = result_with(ControlResult::ok);
  const Choice choice(std::get<Asked>(question).note);
  for (std::size_t i = 0; i < now.cell->components.size(); ++i) {
    const ComponentDescription& component = now.cell->components[i];
    if (!choice.has(component.name, component.type)) continue;
    const ComponentSample& sample = now.snapshot->components[i];
    auto& state = response.states.emplace_back();
    response.entities.push_back(component.name);
    state.header.stamp = to_time(now.snapshot->time_s);
    state.header.frame_id = kWorldFrame;
    state.pose.position = {sample.p_WB.x(), sample.p_WB.y(), sample.p_WB.z()};
    const Quat& q = sample.q_WB;
    state.pose.orientation = {q.x(), q.y(), q.z(), q.w()};
    state.twist = {ros_vector(sample.V_WB.v), ros_vector(sample.V_WB.w)};
  }
}

void answer(const Instant& now, const srv::GetEntityInfo_Request& request,
            srv::GetEntityInfo_Response& response) {
  const int found = find_entity(now, request.entity, response.result);
  if (found < 0) return;
  const ComponentDescription& component = now.cell->components[static_cast<std::size_t>(found)];
  response.info.category.category = category_number(component.type);
  response.info.description = std::string(to_string(component.type));
  if (component.type == ComponentType::part)
    response.info.description +=
        " of " + number_text(component.mass_kg) + " kg, hierarchy " + std::to_string(component.hierarchy);
}

void answer(const Instant& now, const srv::GetEntityBounds_Request& request,
            srv::GetEntityBounds_Response& response) {
  const int found = find_entity(now, request.entity, response.result);
  if (found < 0) return;
  const auto& vertices = now.cell->components[static_cast<std::size_t>(found)].mesh->vertices;
  if (vertices.size() < 3) {
    response.result = result_with(ControlResult::failed, "The entity has no mesh.");
    return;
  }
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (std::size_t i = 0; i + 2 < vertices.size(); i += 3) {
    const Vec3 vertex(vertices[i], vertices[i + 1], vertices[i + 2]);
    lower = lower.cwiseMin(vertex);
    upper = upper.cwiseMax(vertex);
  }
  constexpr std::uint8_t kBox = 1;
  response.bounds.type = kBox;
  response.bounds.points = {ros_vector(upper), ros_vector(lower)};
}

simulation_interfaces::msg::Result result_of(const ControlReply& reply) {
  simulation_interfaces::msg::Result result;
  result.result = static_cast<std::uint8_t>(reply.result);
  result.error_message = reply.message;
  return result;
}

Question ask(const srv::GetSimulatorFeatures_Request&) {
  return plain(requests::GetFeatures{});
}
Question ask(const srv::GetSimulationState_Request&) {
  return plain(requests::GetState{});
}
Question ask(const srv::SetSimulationState_Request& request) {
  return plain(requests::SetState{static_cast<SimulationState>(request.state.state)});
}
Question ask(const srv::StepSimulation_Request& request) {
  return plain(requests::Step{request.steps});
}
Question ask(const srv::ResetSimulation_Request& request) {
  return plain(requests::Reset{request.scope});
}
Question ask(const srv::LoadWorld_Request& request) {
  const auto& resource = request.world_resource;
  if (!resource.uri.empty()) return plain(requests::LoadScenario{.uri = resource.uri});
  if (resource.resource_string.empty())
    return Refusal{ControlResult::uri_missing, "The uri of a scenario file is missing."};
  return Refusal{ControlResult::unsupported,
                 "A scenario cannot be passed as text here, since the files it names are relative to its own "
                 "file; pass its uri."};
}
Question ask(const srv::UnloadWorld_Request&) {
  return plain(requests::UnloadScenario{});
}

Question ask(const srv::GetEntities_Request& request) {
  const auto& filters = request.filters;
  constexpr std::size_t kLongest = 200;
  if (!filters.tags.tags.empty())
    return Refusal{ControlResult::unsupported, "Components have no tags here; leave that filter empty."};
  if (!filters.bounds.points.empty())
    return Refusal{ControlResult::unsupported, "There is no filter by bounds here; leave it empty."};
  const std::string& pattern = filters.filter;
  if (pattern.size() > kLongest || pattern.find_first_of("{\n") != std::string::npos)
    return Refusal{ControlResult::unsupported,
                   "A filter is a POSIX extended regular expression of at most 200 characters, without "
                   "repetition counts in braces."};
  if (!Expression(pattern).good())
    return Refusal{ControlResult::failed,
                   "The filter '" + pattern + "' is no POSIX extended regular expression."};
  return Asked{control_request(requests::GetEntities{}), filter_note(filters)};
}
Question ask(const srv::GetEntityState_Request& request) {
  return plain(requests::GetEntityState{request.entity});
}
Question ask(const srv::SetEntityState_Request& request) {
  const auto& state = request.state;
  if (!is_world(state.header.frame_id)) return wrong_frame(state.header.frame_id);
  if (request.set_acceleration)
    return Refusal{
        ControlResult::unsupported,
        "An acceleration cannot be set: it follows from the forces. Leave set_acceleration false."};
  requests::SetEntityState wanted{.entity = request.entity};
  if (request.set_pose) {
    wanted.position = vector_of(state.pose.position);
    wanted.orientation = orientation_of(state.pose);
  }
  if (request.set_twist) {
    wanted.linear_velocity = vector_of(state.twist.linear);
    wanted.angular_velocity = vector_of(state.twist.angular);
  }
  return plain(wanted);
}

Question ask(const srv::SpawnEntity_Request& request) {
  constexpr std::string_view kCopy = "copy_of:";
  if (!is_world(request.initial_pose.header.frame_id))
    return wrong_frame(request.initial_pose.header.frame_id);
  if (!request.entity_namespace.empty())
    return Refusal{ControlResult::unsupported, "Parts have no topics of their own, so no namespace either."};
  std::string resource = request.entity_resource.uri;
  if (resource.empty())
    return Refusal{ControlResult::no_resource,
                   "The uri is missing: a mesh file, or copy_of:NAME for another one of the Part NAME."};
  std::vector<std::pair<std::string, std::string>> further;
  if (const auto mark = resource.find('?'); mark != std::string::npos) {
    std::string_view query = std::string_view(resource).substr(mark + 1);
    while (!query.empty()) {
      const auto pair = query.substr(0, query.find('&'));
      const auto equals = pair.find('=');
      if (equals == std::string_view::npos || equals == 0)
        return Refusal{ControlResult::spawn_parse_error,
                       "Behind the question mark of a uri stand NAME=VALUE, separated by &."};
      further.emplace_back(pair.substr(0, equals), pair.substr(equals + 1));
      query.remove_prefix(std::min(query.size(), pair.size() + 1));
    }
    resource.resize(mark);
  }
  requests::SpawnEntity wanted{.name = request.name, .allow_renaming = request.allow_renaming};
  const bool find_name = request.name.empty() && request.allow_renaming;
  if (resource.starts_with(kCopy)) {
    wanted.copy_of = resource.substr(kCopy.size());
    if (find_name) wanted.name = *wanted.copy_of;
  } else {
    wanted.uri = resource;
    if (find_name) wanted.name = std::filesystem::path(resource).stem().string();
  }
  wanted.position = vector_of(request.initial_pose.pose.position);
  wanted.orientation = orientation_of(request.initial_pose.pose);
  Asked asked{control_request(wanted), {}};
  for (auto& argument : arguments_of_text(asked.request.request, further))
    asked.request.arguments.push_back(std::move(argument));
  return asked;
}
std::variant<std::vector<Question>, Refusal> ask(const srv::SpawnEntities_Request& request) {
  constexpr std::size_t kMost = 100;
  if (request.spawn_requests.size() > kMost)
    return Refusal{ControlResult::failed, "There are " + std::to_string(request.spawn_requests.size()) +
                                              " entities to spawn; at most " + std::to_string(kMost) +
                                              " are possible in one call."};
  std::vector<Question> questions;
  for (const msg::SpawnEntity& one : request.spawn_requests) {
    srv::SpawnEntity_Request single;
    single.name = one.name;
    single.allow_renaming = one.allow_renaming;
    single.entity_resource = one.entity_resource;
    single.entity_namespace = one.entity_namespace;
    single.initial_pose = one.initial_pose;
    questions.push_back(ask(single));
  }
  return questions;
}
Question ask(const srv::DeleteEntity_Request& request) {
  return plain(requests::DeleteEntity{request.entity});
}
Question ask(const takt_msgs::srv::Control_Request& request) {
  return Asked{{0, request.request, request.arguments}, {}};
}

void respond(const ControlReply& reply, const std::string&, srv::GetSimulatorFeatures_Response& response) {
  const auto known =
      response_of<requests::GetFeaturesResponse>(reply).value_or(requests::GetFeaturesResponse{});
  auto& features = response.features;
  features.features = {kSpawning,           kDeleting,
                       kEntityBounds,       kEntityCategories,
                       kEntityStateGetting, kEntityStateSetting,
                       kEntityInfoGetting,  kReset,
                       kResetTime,          kResetState,
                       kResetSpawned,       kStateGetting,
                       kStateSetting,       kPause,
                       kStepSingle,         kStepMultiple,
                       kStepAction,         kWorldLoading,
                       kWorldUnloading,     kSpawningEntities};
  features.spawn_formats = known.spawn_formats;
  features.custom_info = reply.message + " Further requests by the service 'control':";
  for (const std::string& request : known.requests) features.custom_info += " " + request;
}
void respond(const ControlReply& reply, const std::string&, srv::GetSimulationState_Response& response) {
  response.result = result_of(reply);
  if (const auto known = response_of<requests::GetStateResponse>(reply))
    response.state.state = static_cast<std::uint8_t>(known->state);
}
void respond(const ControlReply& reply, const std::string&, srv::LoadWorld_Response& response) {
  response.result = result_of(reply);
  const auto loaded = response_of<requests::LoadScenarioResponse>(reply);
  if (!loaded) return;
  response.world.name = loaded->scenario;
  response.world.world_resource.uri = loaded->uri;
}
void respond(const ControlReply& reply, const std::string& note, srv::GetEntities_Response& response) {
  response.result = result_of(reply);
  const auto found = response_of<requests::GetEntitiesResponse>(reply);
  if (!found) return;
  const Choice choice(note);
  for (const auto& entity : found->entities)
    if (choice.has(entity.name, entity.type)) response.entities.push_back(entity.name);
}
void respond(const ControlReply& reply, const std::string&, srv::GetEntityState_Response& response) {
  response.result = result_of(reply);
  const auto known = response_of<requests::GetEntityStateResponse>(reply);
  if (!known) return;
  const auto copy = [](const takt_msgs::msg::Vector3& from, auto& to) {
    to.x = from.x, to.y = from.y, to.z = from.z;
  };
  auto& state = response.state;
  state.header.stamp = to_time(known->time);
  state.header.frame_id = kWorldFrame;
  copy(known->position, state.pose.position);
  const auto& q = known->orientation;
  state.pose.orientation.x = q.x, state.pose.orientation.y = q.y, state.pose.orientation.z = q.z;
  state.pose.orientation.w = q.w;
  copy(known->linear_velocity, state.twist.linear);
  copy(known->angular_velocity, state.twist.angular);
}
void respond(const ControlReply& reply, const std::string&, srv::SpawnEntity_Response& response) {
  response.result = result_of(reply);
  if (const auto spawned = response_of<requests::SpawnEntityResponse>(reply))
    response.entity_name = spawned->entity;
}
void respond(std::span<const ControlReply> replies, srv::SpawnEntities_Response& response) {
  constexpr std::uint8_t kSomeFailed = 150;
  std::size_t failed = 0;
  for (const ControlReply& reply : replies) {
    srv::SpawnEntity_Response single;
    respond(reply, {}, single);
    if (reply.result != ControlResult::ok) ++failed;
    response.results.push_back({single.result, single.entity_name});
  }
  response.result.result = failed == 0 ? static_cast<std::uint8_t>(ControlResult::ok) : kSomeFailed;
  if (failed > 0)
    response.result.error_message = std::to_string(failed) + " of " + std::to_string(replies.size()) +
                                    " entities were not spawned; see their results.";
}
void respond(const ControlReply& reply, const std::string&, takt_msgs::srv::Control_Response& response) {
  response.result = static_cast<std::int32_t>(reply.result);
  response.message = reply.message;
  response.values = reply.values;
}

}  // namespace takt::ros
