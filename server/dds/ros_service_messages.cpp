#include "server/dds/ros_service_messages.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <tuple>

#include "idl/common/cdr.h"
#include "idl/common/frames.h"
#include "idl/common/stamp.h"
#include "idl/common/text.h"
#include "idl/common/utf8.h"
#include "server/dds/ros_filters.h"
#include "server/runtime/host/file_lists.h"

namespace takt::ros {
namespace {

namespace msg = simulation_interfaces::msg;

// Of SimulatorFeatures.msg.
enum Feature : std::uint16_t {
  kSpawning = 0,
  kDeleting = 1,
  kNamedPoses = 2,
  kPoseBounds = 3,
  kEntityTags = 4,
  kEntityBounds = 5,
  kEntityCategories = 8,
  kEntityStateGetting = 10,
  kEntityStateSetting = 11,
  kEntityInfoGetting = 12,
  kEntityInfoSetting = 13,
  kSpawnables = 14,
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
  kWorldTags = 42,
  kWorldUnloading = 43,
  kWorldInfoGetting = 44,
  kAvailableWorlds = 45,
  kSpawningEntities = 50,
};
/// Ahead of the name of a Part, in the uri of an entity to spawn.
constexpr std::string_view kCopy = "copy_of:";
/// Behind a mesh file, so that the uri of a spawnable can be called as it is.
constexpr const char* kUsualMass = "?mass=1";

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

/// A message as a note for the response.
std::string note_of(const auto& message) {
  std::string note;
  (void)cdr::write(message, note);
  return note;
}
template <typename Message>
Message noted(const std::string& note) {
  Message message;
  (void)cdr::read({reinterpret_cast<const std::uint8_t*>(note.data()), note.size()}, message);
  return message;
}

msg::Bounds box_bounds(const auto& lower, const auto& upper) {
  constexpr std::uint8_t kBox = 1;
  return {kBox, {{upper.x, upper.y, upper.z}, {lower.x, lower.y, lower.z}}};
}

msg::WorldResource world_of(const auto& scenario) {
  return {scenario.scenario, {scenario.uri, ""}, scenario.description, scenario.tags};
}

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
  if (const auto refusal = fault_of(request.filters)) {
    response.result = result_with(refusal->result, refusal->message);
    return;
  }
  if (now.cell == nullptr) {
    response.result = result_with(ControlResult::incorrect_state, "No scenario is loaded.");
    return;
  }
  response.result = result_with(ControlResult::ok);
  const EntityChoice choice(request.filters);
  for (std::size_t i = 0; i < now.cell->components.size(); ++i) {
    const ComponentDescription& component = now.cell->components[i];
    if (!choice.has(now.infos->of(component))) continue;
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
  requests::EntityInfo info = now.infos->of(now.cell->components[static_cast<std::size_t>(found)]);
  response.info.category.category = static_cast<std::uint8_t>(info.category);
  response.info.description = std::move(info.description);
  response.info.tags = std::move(info.tags);
}

void answer(const Instant& now, const srv::GetEntityBounds_Request& request,
            srv::GetEntityBounds_Response& response) {
  const int found = find_entity(now, request.entity, response.result);
  if (found < 0) return;
  const auto box = now.cell->components[static_cast<std::size_t>(found)].box();
  if (!box) {
    response.result = result_with(ControlResult::failed, "The entity has no mesh.");
    return;
  }
  response.bounds = box_bounds(ros_vector((*box)[0]), ros_vector((*box)[1]));
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
  if (!resource.uri.empty()) {
    if (has_extension(resource.uri, {"yaml", "yml"}))
      return plain(requests::LoadScenario{.uri = resource.uri});
    return Refusal{ControlResult::unsupported_world_format,
                   "'" + resource.uri.substr(0, 200) + "' is no scenario file; allowed is NAME.yaml."};
  }
  if (resource.resource_string.empty())
    return Refusal{ControlResult::uri_missing, "The uri of a scenario file is missing."};
  return Refusal{ControlResult::unsupported,
                 "A scenario cannot be passed as text here, since the files it names are relative to its own "
                 "file; pass its uri."};
}
Question ask(const srv::UnloadWorld_Request&) {
  return plain(requests::UnloadScenario{});
}

Question ask(const srv::GetAvailableWorlds_Request& request) {
  if (auto refusal = fault_of(request.filter)) return *std::move(refusal);
  return Asked{control_request(requests::GetScenarios{.sources = request.additional_sources,
                                                      .continue_on_error = request.continue_on_error}),
               note_of(request.filter)};
}
Question ask(const srv::GetCurrentWorld_Request&) {
  return plain(requests::GetScenario{});
}
Question ask(const srv::GetNamedPoses_Request& request) {
  if (auto refusal = fault_of(request.tags)) return *std::move(refusal);
  return Asked{control_request(requests::GetNamedPoses{}), note_of(request.tags)};
}
Question ask(const srv::GetNamedPoseBounds_Request& request) {
  return Asked{control_request(requests::GetNamedPoses{}), request.name};
}
Question ask(const srv::GetSpawnables_Request& request) {
  return plain(requests::GetSpawnables{request.sources});
}

Question ask(const srv::GetEntities_Request& request) {
  if (auto refusal = fault_of(request.filters)) return *std::move(refusal);
  return Asked{control_request(requests::GetEntities{}), note_of(request.filters)};
}
Question ask(const srv::SetEntityInfo_Request& request) {
  return plain(
      requests::SetEntityInfo{.entity = request.entity,
                              .category = static_cast<EntityCategory>(request.info.category.category),
                              .description = request.info.description,
                              .tags = request.info.tags});
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
    const std::vector<std::string> formats = features().spawn_formats;
    // Of a node FILE.glb#NODE the extension is that of the file.
    if (!has_extension(resource, formats) && !has_extension(resource.substr(0, resource.find('#')), formats))
      return Refusal{ControlResult::unsupported_spawn_format,
                     "'" + resource.substr(0, 200) + "' is no mesh file; its extension is one of " +
                         list_names(formats) + ", or the uri is copy_of:NAME."};
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
  features.features = {kSpawning,
                       kDeleting,
                       kNamedPoses,
                       kPoseBounds,
                       kEntityTags,
                       kEntityBounds,
                       kEntityCategories,
                       kEntityStateGetting,
                       kEntityStateSetting,
                       kEntityInfoGetting,
                       kEntityInfoSetting,
                       kSpawnables,
                       kReset,
                       kResetTime,
                       kResetState,
                       kResetSpawned,
                       kStateGetting,
                       kStateSetting,
                       kPause,
                       kStepSingle,
                       kStepMultiple,
                       kStepAction,
                       kWorldLoading,
                       kWorldTags,
                       kWorldUnloading,
                       kWorldInfoGetting,
                       kAvailableWorlds,
                       kSpawningEntities};
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
  if (const auto loaded = response_of<requests::LoadScenarioResponse>(reply))
    response.world = world_of(*loaded);
}
void respond(const ControlReply& reply, const std::string&, srv::GetCurrentWorld_Response& response) {
  response.result = result_of(reply);
  if (const auto loaded = response_of<requests::GetScenarioResponse>(reply))
    response.world = world_of(*loaded);
}
void respond(const ControlReply& reply, const std::string& note, srv::GetAvailableWorlds_Response& response) {
  response.result = result_of(reply);
  const auto listed = response_of<requests::GetScenariosResponse>(reply);
  if (!listed) return;
  const auto filter = noted<msg::TagsFilter>(note);
  for (const requests::ScenarioFile& scenario : listed->scenarios)
    if (matches(filter, scenario.tags)) response.worlds.push_back(world_of(scenario));
}
void respond(const ControlReply& reply, const std::string& note, srv::GetNamedPoses_Response& response) {
  response.result = result_of(reply);
  const auto named = response_of<requests::GetNamedPosesResponse>(reply);
  if (!named) return;
  const auto filter = noted<msg::TagsFilter>(note);
  for (const requests::NamedPose& pose : named->poses) {
    if (!matches(filter, pose.tags)) continue;
    const auto& [p, q] = std::tie(pose.position, pose.orientation);
    response.poses.push_back(
        {pose.name, pose.description, pose.tags, {{p.x, p.y, p.z}, {q.x, q.y, q.z, q.w}}});
  }
}
void respond(const ControlReply& reply, const std::string& note, srv::GetNamedPoseBounds_Response& response) {
  response.result = result_of(reply);
  const auto named = response_of<requests::GetNamedPosesResponse>(reply);
  if (!named) return;
  const auto& poses = named->poses;
  const auto found = std::find_if(poses.begin(), poses.end(), [&](const auto& p) { return p.name == note; });
  if (found == poses.end()) {
    response.result =
        result_with(ControlResult::not_found, "There is no named pose '" + utf8_sanitize(note, 60) +
                                                  "'; there are " + list_names(poses) + ".");
  } else if (found->lower && found->upper) {
    response.bounds = box_bounds(*found->lower, *found->upper);
  }
}
void respond(const ControlReply& reply, const std::string&, srv::GetSpawnables_Response& response) {
  response.result = result_of(reply);
  const auto listed = response_of<requests::GetSpawnablesResponse>(reply);
  if (!listed) return;
  for (const requests::Spawnable& one : listed->spawnables) {
    msg::Spawnable& spawnable = response.spawnables.emplace_back();
    spawnable.entity_resource.uri = one.copy_of ? std::string(kCopy) + *one.copy_of : *one.uri + kUsualMass;
    spawnable.description = one.description;
    if (one.lower && one.upper) spawnable.spawn_bounds = box_bounds(*one.lower, *one.upper);
  }
}
void respond(const ControlReply& reply, const std::string& note, srv::GetEntities_Response& response) {
  response.result = result_of(reply);
  const auto found = response_of<requests::GetEntitiesResponse>(reply);
  if (!found) return;
  const EntityChoice choice(noted<msg::EntityFilters>(note));
  for (const requests::EntityInfo& entity : found->entities)
    if (choice.has(entity)) response.entities.push_back(entity.name);
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
