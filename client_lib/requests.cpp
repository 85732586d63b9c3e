// The requests of takt::Client: typed functions over request(), and what is learnt from replies.
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "client_lib/client_impl.h"
#include "client_lib/reply_document.h"
#include "idl/common/text.h"

namespace takt::client {
namespace {

std::string text(const Vector3& v) {
  return exact_text(v.x) + " " + exact_text(v.y) + " " + exact_text(v.z);
}
std::string text(const Quaternion& q) {
  return exact_text(q.x) + " " + exact_text(q.y) + " " + exact_text(q.z) + " " + exact_text(q.w);
}

ClientError unreadable(const std::string& request, const std::string& why) {
  return {ClientError::Kind::refused, "The reply to " + request + " cannot be read: " + why + "."};
}

/// Reads the values of one reply.
class Values {
 public:
  Values(const Arguments& values, const char* request) : values_(values), request_(request) {}

  const std::string& text(const char* name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) throw unreadable(request_, std::string("it has no '") + name + "'");
    return found->second;
  }
  template <typename T>
  T number(const char* name) const {
    T value{};
    read(name, text(name), &value, 1);
    return value;
  }
  Vector3 vector(const char* name) const {
    double v[3];
    read(name, text(name), v, 3);
    return {v[0], v[1], v[2]};
  }
  Quaternion quaternion(const char* name) const {
    double q[4];
    read(name, text(name), q, 4);
    return {q[0], q[1], q[2], q[3]};
  }
  template <typename Enum>
  Enum named(const char* name, Enum last) const {
    return by_name(text(name), last, request_);
  }

  template <typename Enum>
  static Enum by_name(const std::string& value, Enum last, const std::string& request) {
    for (std::uint8_t i = 0; i <= static_cast<std::uint8_t>(last); ++i)
      if (to_string(static_cast<Enum>(i)) == value) return static_cast<Enum>(i);
    throw unreadable(request, "'" + value + "' is not known to this client");
  }

 private:
  template <typename T>
  void read(const char* name, const std::string& value, T* into, std::size_t count) const {
    const char* at = value.data();
    const char* end = at + value.size();
    for (std::size_t i = 0; i < count; ++i) {
      while (at != end && *at == ' ') ++at;
      const auto [last, error] = std::from_chars(at, end, into[i]);
      if (error != std::errc()) throw unreadable(request_, "'" + std::string(name) + "' is '" + value + "'");
      at = last;
    }
  }

  const Arguments& values_;
  const std::string request_;
};

}  // namespace

void Client::Impl::apply_reply_causality(std::unique_lock<std::mutex>& lock, const std::string& request,
                                         const Arguments& values, std::uint32_t generation_before,
                                         Clock::time_point deadline) {
  const auto number = [&](const char* name) -> std::optional<std::uint64_t> {
    const auto found = values.find(name);
    if (found == values.end() || found->second.empty() ||
        found->second.find_first_not_of("0123456789") != std::string::npos)
      return std::nullopt;
    return std::strtoull(found->second.c_str(), nullptr, 10);
  };
  // Another scenario: its description may take longer than the reply.
  auto world = number("world");
  if (!world && request == "unload_scenario") world = generation_before + 1U;
  if (world) {
    if (!wait(lock, deadline, [&] { return cell && cell->scenario_generation >= *world; }))
      throw ClientError(ClientError::Kind::timeout,
                        where() + " has done '" + request + "', but its new description has not come.");
    return;
  }
  if (cell->scenario_generation != generation_before) return;
  const auto step = number("step"), epoch = number("epoch");
  if (step || epoch) {
    const std::uint32_t present = state ? std::max(known.first, state->epoch) : known.first;
    known = std::max(known, {epoch ? static_cast<std::uint32_t>(*epoch) : present, step.value_or(0)});
    if (state && is_older_than_known(state->epoch, state->step)) state.reset();
    if (power && is_older_than_known(power->epoch, power->step)) power.reset();
    if (contacts && is_older_than_known(contacts->epoch, contacts->step)) contacts.reset();
    if (status && is_older_than_known(status->epoch, status->step)) status.reset();
  }
  // What changes without a step being taken shows in the next sample.
  const bool stops = request == "set_state" && number("state") == 0U;
  if (stops || request == "set_entity_state" || request == "attach" || request == "detach") state.reset();
  const bool quits = request == "set_state" && number("state") == 3U;
  if ((request == "set_state" && !quits) || request == "set_pace" || request == "set_level_of_detail")
    status.reset();
}

Arguments Client::get_features() {
  return request("get_features").values;
}

SimulationState Client::get_state() {
  const Reply reply = request("get_state");
  const auto found = reply.values.find("state");
  for (int i = 0; found != reply.values.end() && i <= static_cast<int>(SimulationState::loading_world); ++i)
    if (found->second == std::to_string(i)) return static_cast<SimulationState>(i);
  throw ClientError(ClientError::Kind::refused, "The reply to get_state names no state this client knows.");
}

void Client::set_state(SimulationState state) {
  request("set_state", {{"state", std::to_string(static_cast<int>(state))}});
}

void Client::step(std::uint64_t steps, std::optional<Seconds> timeout) {
  request("step", {{"steps", std::to_string(steps)}}, timeout);
}

void Client::reset() {
  request("reset");
}

void Client::set_pace(Pace pace, double factor) {
  if (!std::isfinite(factor))
    throw ClientError(ClientError::Kind::invalid, "The factor of the pace must be a finite number.");
  const char* name = pace == Pace::realtime ? "realtime" : pace == Pace::free ? "free" : "lockstep";
  Arguments arguments{{"pace", name}};
  if (pace == Pace::realtime) arguments["factor"] = exact_text(factor);
  request("set_pace", arguments);
}

void Client::set_level_of_detail(int level, const std::string& process) {
  request("set_level_of_detail", {{"level", std::to_string(level)}, {"process", process}});
}

Reply Client::register_controller(const std::string& name, Seconds period, Seconds timeout,
                                  const std::vector<std::string>& targets) {
  return request("register_controller", {{"name", name},
                                         {"period_s", exact_text(period.count())},
                                         {"timeout_s", exact_text(timeout.count())},
                                         {"targets", join(targets, ",")}});
}

void Client::unregister_controller(const std::string& name) {
  request("unregister_controller", {{"name", name}});
}

PartExplanation Client::explain_part(const std::string& part, std::optional<Seconds> timeout) {
  return part_explanation(request("explain_part", {{"part", part}}, timeout).values);
}

std::shared_ptr<const CellInfo> Client::load_scenario(const std::string& file, const LoadOptions& options) {
  Arguments arguments{{"uri", file}};
  std::string overrides;
  for (const std::string& line : options.overrides) overrides += line + "\n";
  if (!overrides.empty()) arguments["overrides"] = overrides;
  if (options.level_of_detail) arguments["lod"] = std::to_string(*options.level_of_detail);
  request("load_scenario", arguments, options.timeout);
  return cell();
}

std::shared_ptr<const CellInfo> Client::reload_scenario(std::optional<Seconds> timeout) {
  request("reload_scenario", {}, timeout);
  return cell();
}

void Client::unload_scenario(std::optional<Seconds> timeout) {
  request("unload_scenario", {}, timeout);
}

std::string Client::spawn_entity(const SpawnRequest& spawn, std::optional<Seconds> timeout) {
  Arguments arguments{
      {"name", spawn.name}, {"position", text(spawn.position_m)}, {"orientation", text(spawn.orientation)}};
  if (spawn.allow_renaming) arguments["allow_renaming"] = "true";
  if (!spawn.mesh.empty()) arguments["uri"] = spawn.mesh;
  if (!spawn.copy_of.empty()) arguments["copy_of"] = spawn.copy_of;
  if (spawn.mesh_scale != 1.0) arguments["mesh_scale"] = exact_text(spawn.mesh_scale);
  if (spawn.mass_kg) arguments["mass_kg"] = exact_text(*spawn.mass_kg);
  if (spawn.hierarchy) arguments["hierarchy"] = std::to_string(*spawn.hierarchy);
  const Reply reply = request("spawn_entity", arguments, timeout);
  return Values(reply.values, "spawn_entity").text("entity");
}

void Client::delete_entity(const std::string& entity, std::optional<Seconds> timeout) {
  request("delete_entity", {{"entity", entity}}, timeout);
}

std::vector<EntityInfo> Client::get_entities(const std::string& filter, const std::string& category) {
  Arguments arguments;
  if (!filter.empty()) arguments["filter"] = filter;
  if (!category.empty()) arguments["category"] = category;
  const Reply reply = request("get_entities", arguments);
  std::vector<EntityInfo> entities;
  try {
    for (const auto& item : nlohmann::json::parse(reply_document(reply.values, "get_entities"))) {
      EntityInfo& entity = entities.emplace_back();
      entity.name = item.at("name").get<std::string>();
      entity.category =
          Values::by_name(item.at("category").get<std::string>(), ComponentType::ground, "get_entities");
      if (!item.at("hierarchy").is_null()) entity.hierarchy = item.at("hierarchy").get<int>();
      if (!item.at("mass").is_null()) entity.mass_kg = item.at("mass").get<double>();
    }
  } catch (const nlohmann::json::exception& error) {
    throw unreadable("get_entities", error.what());
  }
  return entities;
}

EntityState Client::get_entity_state(const std::string& entity) {
  const Reply reply = request("get_entity_state", {{"entity", entity}});
  const Values values(reply.values, "get_entity_state");
  EntityState state;
  state.name = values.text("entity");
  state.category = values.named("category", ComponentType::ground);
  state.position_m = values.vector("position");
  state.orientation = values.quaternion("orientation");
  state.linear_velocity = values.vector("linear_velocity");
  state.angular_velocity = values.vector("angular_velocity");
  state.state = values.named("state", PartState::fixed);
  state.partner = values.text("partner");
  state.time_s = values.number<double>("time");
  state.step = values.number<std::uint64_t>("step");
  state.epoch = values.number<std::uint32_t>("epoch");
  return state;
}

void Client::set_entity_state(const std::string& entity, const EntityPlacement& placement) {
  Arguments arguments{{"entity", entity}};
  if (placement.position_m) arguments["position"] = text(*placement.position_m);
  if (placement.orientation) arguments["orientation"] = text(*placement.orientation);
  if (placement.linear_velocity) arguments["linear_velocity"] = text(*placement.linear_velocity);
  if (placement.angular_velocity) arguments["angular_velocity"] = text(*placement.angular_velocity);
  request("set_entity_state", arguments);
}

void Client::attach(const std::string& part, const std::string& to) {
  request("attach", {{"part", part}, {"to", to}});
}

void Client::detach(const std::string& part) {
  request("detach", {{"part", part}});
}

Reply Client::save_snapshot(const std::string& name, std::optional<Seconds> timeout) {
  return request("save_snapshot", {{"name", name}}, timeout);
}

Reply Client::restore_snapshot(const std::string& name, std::optional<Seconds> timeout) {
  return request("restore_snapshot", name.empty() ? Arguments{} : Arguments{{"name", name}}, timeout);
}

Reply Client::start_recording(const Arguments& arguments) {
  return request("start_recording", arguments);
}

Reply Client::stop_recording(const Arguments& arguments) {
  return request("stop_recording", arguments);
}

Reply Client::request(const std::string& name, const Arguments& arguments, std::optional<Seconds> timeout) {
  return impl_->call(name, arguments, timeout.value_or(impl_->options.timeout));
}

}  // namespace takt::client
