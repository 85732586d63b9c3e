#include "server/runtime/requests/host_requests.h"

#include <algorithm>

#include "server/runtime/requests/entity_requests.h"
#include "server/runtime/requests/request_arguments.h"
#include "server/scenario/scenario.h"

namespace takt {
namespace {

/// As for what set_entity_state puts elsewhere.
constexpr double kFurthest_m = 1e9;

using ParsedHostRequest = std::variant<HostAction, ControlReply>;

std::filesystem::path path_of(std::string uri) {
  constexpr std::string_view kScheme = "file://";
  if (uri.starts_with(kScheme)) uri.erase(0, kScheme.size());
  return uri;
}

ParsedHostRequest parse_load(const ControlRequest& request) {
  RequestArguments arguments(request, {"uri", "overrides", "lod"});
  LoadScenario action;
  action.file = path_of(arguments.text("uri", "the scenario file."));
  if (const std::string* overrides = arguments.find("overrides")) {
    std::size_t begin = 0;
    while (begin < overrides->size()) {
      const std::size_t end = std::min(overrides->find('\n', begin), overrides->size());
      if (end > begin) action.options.overrides.push_back(overrides->substr(begin, end - begin));
      begin = end + 1;
    }
  }
  if (arguments.find("lod") != nullptr) {
    action.options.level_of_detail = static_cast<int>(arguments.natural("lod", std::nullopt, 1, 3));
  }
  return arguments.result<HostAction>(action);
}

ParsedHostRequest parse_spawn(const ControlRequest& request) {
  RequestArguments arguments(request, {"name", "allow_renaming", "uri", "copy_of", "mesh_scale", "mass_kg",
                                       "hierarchy", "position", "orientation"});
  SpawnEntity action;
  action.name = arguments.text("name", "what the new Part is called.");
  if (const std::string* rename = arguments.find("allow_renaming")) {
    if (*rename != "true" && *rename != "false")
      arguments.fail_value("allow_renaming", rename, "true or false");
    action.allow_renaming = *rename == "true";
  }
  const std::string* uri = arguments.find("uri");
  const std::string* copy_of = arguments.find("copy_of");
  if ((uri == nullptr) == (copy_of == nullptr)) {
    arguments.fail("needs either 'uri', a mesh file, or 'copy_of', a Part of the scenario.");
  }
  if (uri != nullptr) action.mesh = path_of(arguments.text("uri", "the mesh file."));
  if (copy_of != nullptr) action.copy_of = arguments.text("copy_of", "a Part of the scenario.");
  if (copy_of != nullptr && arguments.find("mesh_scale") != nullptr) {
    arguments.fail("takes 'mesh_scale' only together with 'uri'.");
  }
  action.mesh_scale = arguments.real("mesh_scale", 1.0, 1e-6, 1e6);
  if (uri != nullptr || arguments.find("mass_kg") != nullptr) {
    action.mass_kg = arguments.real("mass_kg", std::nullopt, 1e-9, 1e9);
  }
  if (arguments.find("hierarchy") != nullptr) {
    action.hierarchy =
        static_cast<int>(arguments.natural("hierarchy", std::nullopt, kMinHierarchy, kMaxHierarchy));
  }
  const GivenPose pose = read_pose(arguments);
  if (!pose.p) arguments.fail("needs the argument 'position': three numbers in m.");
  if (pose.p && !(pose.p->cwiseAbs().maxCoeff() <= kFurthest_m))
    arguments.fail_value("position", arguments.find("position"), "three numbers from -1e9 to 1e9 m");
  action.X_WB = {pose.R.value_or(Mat3::Identity()), pose.p.value_or(Vec3::Zero())};
  return arguments.result<HostAction>(action);
}

ParsedHostRequest parse_delete(const ControlRequest& request) {
  RequestArguments arguments(request, {"entity"});
  return arguments.result<HostAction>(DeleteEntity{arguments.text("entity", "the Part to delete.")});
}

ParsedHostRequest parse_save(const ControlRequest& request) {
  RequestArguments arguments(request, {"name"});
  return arguments.result<HostAction>(SaveSnapshot{arguments.text("name", "what the snapshot is called.")});
}

ParsedHostRequest parse_restore(const ControlRequest& request) {
  RequestArguments arguments(request, {"name"});
  RestoreSnapshot action;
  if (arguments.find("name") != nullptr) action.name = arguments.text("name", "of the snapshot.");
  return arguments.result<HostAction>(action);
}

ParsedHostRequest parse_start_recording(const ControlRequest& request) {
  RequestArguments arguments(request, {"name"});
  return arguments.result<HostAction>(
      StartRecording{arguments.text("name", "what the recording is called.")});
}

ParsedHostRequest parse_watch(const ControlRequest& request) {
  RequestArguments arguments(request, {"pairs", "for_s"});
  WatchPressures action;
  action.pairs = arguments.text("pairs", "names BASE-TARGET, with * for any characters.");
  action.for_s = arguments.real("for_s", 10.0, 0.0, 86400.0);
  return arguments.result<HostAction>(action);
}

/// Nothing: the loop's business.
std::optional<ParsedHostRequest> parse_reset(const ControlRequest& request) {
  const auto parsed = parse(request, CellDescription{});
  if (!std::holds_alternative<ControlAction>(parsed)) return std::nullopt;
  const RequestArguments arguments(request, {"scope"});
  const std::string* scope = arguments.find("scope");
  constexpr std::array<std::string_view, 3> kOthers{"1", "2", "3"};
  if (scope != nullptr && std::find(kOthers.begin(), kOthers.end(), *scope) != kOthers.end())
    return std::nullopt;
  return HostAction(ResetSpawned{std::get<Reset>(std::get<ControlAction>(parsed)).spawned_only});
}

}  // namespace

std::optional<ParsedHostRequest> parse_host_request(const ControlRequest& request, bool with_spawned) {
  const std::string& name = request.request;
  if (name == "load_scenario") return parse_load(request);
  if (name == "unload_scenario") return RequestArguments(request, {}).result<HostAction>(UnloadScenario{});
  if (name == "reload_scenario") return RequestArguments(request, {}).result<HostAction>(ReloadScenario{});
  if (name == "spawn_entity") return parse_spawn(request);
  if (name == "delete_entity") return parse_delete(request);
  if (name == "save_snapshot") return parse_save(request);
  if (name == "restore_snapshot") return parse_restore(request);
  if (name == "start_recording") return parse_start_recording(request);
  if (name == "stop_recording") return RequestArguments(request, {}).result<HostAction>(StopRecording{});
  if (name == "watch_pressures") return parse_watch(request);
  if (name == "reset" && with_spawned) return parse_reset(request);
  return std::nullopt;
}

}  // namespace takt
