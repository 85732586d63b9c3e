#include "server/dds/ros_service_messages.h"

#include <regex.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "idl/common/text.h"
#include "server/dds/convert.h"

namespace takt::ros {
namespace {

namespace msg = simulation_interfaces::msg;

// Of SimulatorFeatures.msg.
enum Feature : std::uint16_t {
  kSpawning = 0,
  kDeleting = 1,
  kEntityCategories = 8,
  kEntityStateGetting = 10,
  kEntityStateSetting = 11,
  kReset = 20,
  kResetTime = 21,
  kResetState = 22,
  kResetSpawned = 23,
  kStateGetting = 24,
  kStateSetting = 25,
  kPause = 26,
  kStepSingle = 31,
  kStepMultiple = 32,
  kWorldLoading = 40,
  kWorldUnloading = 43,
};
// Of EntityCategory.msg.
enum Category : std::uint8_t { kObject = 1, kRobot = 2, kStaticObject = 5 };

Question plain(std::string name, TextArguments arguments = {}) {
  return Asked{{0, std::move(name), std::move(arguments)}, {}};
}
Question refuse(ControlResult result, std::string message) {
  return ControlReply{0, result, std::move(message), {}};
}

const std::string* find(const ControlReply& reply, std::string_view name) {
  for (const auto& [key, value] : reply.values)
    if (key == name) return &value;
  return nullptr;
}
std::string text(const ControlReply& reply, std::string_view name) {
  const std::string* value = find(reply, name);
  return value != nullptr ? *value : std::string();
}
/// Numbers separated by spaces, as takt writes them.
std::vector<double> numbers(const ControlReply& reply, std::string_view name, std::size_t count) {
  std::vector<double> result(count, 0.0);
  const std::string all = text(reply, name);
  const char* at = all.data();
  const char* const end = at + all.size();
  for (double& value : result) {
    while (at != end && *at == ' ') ++at;
    at = std::from_chars(at, end, value).ptr;
  }
  return result;
}

msg::Result result_of(const ControlReply& reply) {
  msg::Result result;
  result.result(static_cast<std::uint8_t>(reply.result));
  result.error_message(reply.message);
  return result;
}

std::string joined(std::initializer_list<double> values) {
  return join(values, " ", exact_text);
}
std::string position_of(const geometry_msgs::msg::Pose& pose) {
  return joined({pose.position().x(), pose.position().y(), pose.position().z()});
}
std::string orientation_of(const geometry_msgs::msg::Pose& pose) {
  const auto& q = pose.orientation();
  if (q.x() == 0.0 && q.y() == 0.0 && q.z() == 0.0 && q.w() == 0.0) return "0 0 0 1";
  return joined({q.x(), q.y(), q.z(), q.w()});
}
bool is_world(const std::string& frame) {
  return frame.empty() || frame == "world";
}
Question wrong_frame(const std::string& frame) {
  return refuse(ControlResult::unsupported, "The frame '" + frame.substr(0, 100) +
                                                "' is not known here; poses are in the frame 'world'.");
}

std::uint8_t category_number(const std::string& category) {
  return category == "part" ? kObject : category == "gripper" ? kRobot : kStaticObject;
}

/// Lines: the expression, then the digits of the categories.
std::string filter_note(const msg::EntityFilters& filters) {
  std::string note = filters.filter() + "\n";
  for (const auto& category : filters.categories()) note += static_cast<char>('0' + category.category() % 10);
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

}  // namespace

Question ask(const srv::GetSimulatorFeatures_Request&) {
  return plain("get_features");
}
Question ask(const srv::GetSimulationState_Request&) {
  return plain("get_state");
}
Question ask(const srv::SetSimulationState_Request& request) {
  return plain("set_state", {{"state", std::to_string(request.state().state())}});
}
Question ask(const srv::StepSimulation_Request& request) {
  return plain("step", {{"steps", std::to_string(request.steps())}});
}
Question ask(const srv::ResetSimulation_Request& request) {
  return plain("reset", {{"scope", std::to_string(request.scope())}});
}
Question ask(const srv::LoadWorld_Request& request) {
  if (request.world_resource().uri().empty()) {
    if (request.world_resource().resource_string().empty())
      return refuse(static_cast<ControlResult>(102), "The uri of a scenario file is missing.");
    return refuse(
        ControlResult::unsupported,
        "A scenario cannot be passed as text here, since the files it names are relative to its own "
        "file; pass its uri.");
  }
  return plain("load_scenario", {{"uri", request.world_resource().uri()}});
}
Question ask(const srv::UnloadWorld_Request&) {
  return plain("unload_scenario");
}

Question ask(const srv::GetEntities_Request& request) {
  const auto& filters = request.filters();
  constexpr std::size_t kLongest = 200;
  if (!filters.tags().tags().empty())
    return refuse(ControlResult::unsupported, "Components have no tags here; leave that filter empty.");
  if (!filters.bounds().points().empty())
    return refuse(ControlResult::unsupported, "There is no filter by bounds here; leave it empty.");
  const std::string& pattern = filters.filter();
  if (pattern.size() > kLongest || pattern.find_first_of("{\n") != std::string::npos)
    return refuse(ControlResult::unsupported,
                  "A filter is a POSIX extended regular expression of at most 200 characters, without "
                  "repetition counts in braces.");
  if (!Expression(pattern).good())
    return refuse(ControlResult::failed,
                  "The filter '" + pattern + "' is no POSIX extended regular expression.");
  return Asked{{0, "get_entities", {}}, filter_note(filters)};
}
Question ask(const srv::GetEntityState_Request& request) {
  return plain("get_entity_state", {{"entity", request.entity()}});
}
Question ask(const srv::SetEntityState_Request& request) {
  const auto& state = request.state();
  if (!is_world(state.header().frame_id())) return wrong_frame(state.header().frame_id());
  if (request.set_acceleration())
    return refuse(ControlResult::unsupported,
                  "An acceleration cannot be set: it follows from the forces. Leave set_acceleration false.");
  TextArguments arguments{{"entity", request.entity()}};
  if (request.set_pose()) {
    arguments.emplace_back("position", position_of(state.pose()));
    arguments.emplace_back("orientation", orientation_of(state.pose()));
  }
  if (request.set_twist()) {
    const auto& v = state.twist().linear();
    const auto& w = state.twist().angular();
    arguments.emplace_back("linear_velocity", joined({v.x(), v.y(), v.z()}));
    arguments.emplace_back("angular_velocity", joined({w.x(), w.y(), w.z()}));
  }
  return plain("set_entity_state", std::move(arguments));
}

Question ask(const srv::SpawnEntity_Request& request) {
  constexpr std::string_view kCopy = "copy_of:";
  if (!is_world(request.initial_pose().header().frame_id()))
    return wrong_frame(request.initial_pose().header().frame_id());
  if (!request.entity_namespace().empty())
    return refuse(ControlResult::unsupported, "Parts have no topics of their own, so no namespace either.");
  std::string resource = request.entity_resource().uri();
  if (resource.empty())
    return refuse(ControlResult::no_resource,
                  "The uri is missing: a mesh file, or copy_of:NAME for another one of the Part NAME.");
  TextArguments arguments;
  if (const auto mark = resource.find('?'); mark != std::string::npos) {
    std::string_view query = std::string_view(resource).substr(mark + 1);
    while (!query.empty()) {
      const auto pair = query.substr(0, query.find('&'));
      const auto equals = pair.find('=');
      if (equals == std::string_view::npos || equals == 0)
        return refuse(ControlResult::spawn_parse_error,
                      "Behind the question mark of a uri stand NAME=VALUE, separated by &.");
      arguments.emplace_back(pair.substr(0, equals), pair.substr(equals + 1));
      query.remove_prefix(std::min(query.size(), pair.size() + 1));
    }
    resource.resize(mark);
  }
  std::string name = request.name();
  if (resource.starts_with(kCopy)) {
    resource.erase(0, kCopy.size());
    if (name.empty() && request.allow_renaming()) name = resource;
    arguments.emplace_back("copy_of", resource);
  } else {
    if (name.empty() && request.allow_renaming()) name = std::filesystem::path(resource).stem().string();
    arguments.emplace_back("uri", resource);
  }
  arguments.emplace_back("name", name);
  arguments.emplace_back("allow_renaming", request.allow_renaming() ? "true" : "false");
  arguments.emplace_back("position", position_of(request.initial_pose().pose()));
  arguments.emplace_back("orientation", orientation_of(request.initial_pose().pose()));
  return plain("spawn_entity", std::move(arguments));
}
Question ask(const srv::DeleteEntity_Request& request) {
  return plain("delete_entity", {{"entity", request.entity()}});
}
Question ask(const takt_msgs::srv::Control_Request& request) {
  Asked asked{{0, request.request(), {}}, {}};
  for (const auto& argument : request.arguments())
    asked.request.arguments.emplace_back(argument.name(), argument.value());
  return asked;
}

void respond(const ControlReply& reply, const std::string&, srv::GetSimulatorFeatures_Response& response) {
  auto& features = response.features();
  features.features({kSpawning, kDeleting, kEntityCategories, kEntityStateGetting, kEntityStateSetting,
                     kReset, kResetTime, kResetState, kResetSpawned, kStateGetting, kStateSetting, kPause,
                     kStepSingle, kStepMultiple, kWorldLoading, kWorldUnloading});
  features.spawn_formats({"obj", "stl", "glb"});
  features.custom_info(reply.message +
                       " Further requests by the service 'control': " + text(reply, "requests") + ".");
}
void respond(const ControlReply& reply, const std::string&, srv::GetSimulationState_Response& response) {
  response.result(result_of(reply));
  const std::string state = text(reply, "state");
  if (state.size() == 1) response.state().state(static_cast<std::uint8_t>(state[0] - '0'));
}
void respond(const ControlReply& reply, const std::string&, srv::SetSimulationState_Response& response) {
  response.result(result_of(reply));
}
void respond(const ControlReply& reply, const std::string&, srv::StepSimulation_Response& response) {
  response.result(result_of(reply));
}
void respond(const ControlReply& reply, const std::string&, srv::ResetSimulation_Response& response) {
  response.result(result_of(reply));
}
void respond(const ControlReply& reply, const std::string&, srv::LoadWorld_Response& response) {
  response.result(result_of(reply));
  response.world().name(text(reply, "scenario"));
  response.world().world_resource().uri(text(reply, "uri"));
}
void respond(const ControlReply& reply, const std::string&, srv::UnloadWorld_Response& response) {
  response.result(result_of(reply));
}

void respond(const ControlReply& reply, const std::string& note, srv::GetEntities_Response& response) {
  response.result(result_of(reply));
  if (reply.result != ControlResult::ok) return;
  std::string document;
  for (const auto& [key, value] : reply.values)
    if (key.starts_with("document_")) document += value;
  const auto list = nlohmann::json::parse(document, nullptr, false);
  if (!list.is_array()) return;
  const auto split = note.find('\n');
  const Expression expression(note.substr(0, split));
  const std::string categories = note.substr(split + 1);
  std::vector<std::string> names;
  for (const auto& entry : list) {
    const std::string name = entry.value("name", std::string());
    const char category = static_cast<char>('0' + category_number(entry.value("category", std::string())));
    if (!categories.empty() && categories.find(category) == std::string::npos) continue;
    if (split > 0 && !(expression.good() && expression.matches(name))) continue;
    names.push_back(name);
  }
  response.entities(std::move(names));
}
void respond(const ControlReply& reply, const std::string&, srv::GetEntityState_Response& response) {
  response.result(result_of(reply));
  if (reply.result != ControlResult::ok) return;
  auto& state = response.state();
  state.header().stamp(to_time(numbers(reply, "time", 1)[0]));
  state.header().frame_id("world");
  const auto p = numbers(reply, "position", 3), q = numbers(reply, "orientation", 4);
  const auto v = numbers(reply, "linear_velocity", 3), w = numbers(reply, "angular_velocity", 3);
  auto& pose = state.pose();
  pose.position().x(p[0]), pose.position().y(p[1]), pose.position().z(p[2]);
  pose.orientation().x(q[0]), pose.orientation().y(q[1]), pose.orientation().z(q[2]);
  pose.orientation().w(q[3]);
  auto& twist = state.twist();
  twist.linear().x(v[0]), twist.linear().y(v[1]), twist.linear().z(v[2]);
  twist.angular().x(w[0]), twist.angular().y(w[1]), twist.angular().z(w[2]);
}
void respond(const ControlReply& reply, const std::string&, srv::SetEntityState_Response& response) {
  response.result(result_of(reply));
}
void respond(const ControlReply& reply, const std::string&, srv::SpawnEntity_Response& response) {
  response.result(result_of(reply));
  response.entity_name(text(reply, "entity"));
}
void respond(const ControlReply& reply, const std::string&, srv::DeleteEntity_Response& response) {
  response.result(result_of(reply));
}
void respond(const ControlReply& reply, const std::string&, takt_msgs::srv::Control_Response& response) {
  response.result(static_cast<std::int32_t>(reply.result));
  response.message(reply.message);
  for (const auto& [name, value] : reply.values) {
    takt_msgs::srv::Argument argument;
    argument.name(name);
    argument.value(value);
    response.values().push_back(argument);
  }
}

}  // namespace takt::ros
