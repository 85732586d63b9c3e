#pragma once
// The control vocabulary, that of simulation_interfaces 2.1: requests by name with arguments as text, checked
// here and turned into an action for the step loop. A request that is not known or not well-formed is
// answered at once.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "server/runtime/pacer.h"
#include "server/runtime/requests/event.h"
#include "server/simulation/model/cell_description.h"

namespace takt {

using TextArguments = std::vector<std::pair<std::string, std::string>>;

struct ControlRequest {
  std::uint64_t id = 0;  ///< chosen by who submits it, comes back in the reply
  std::string request;
  TextArguments arguments;
};

/// Result codes of simulation_interfaces.
enum class ControlResult : std::int32_t {
  unsupported = 0,
  ok = 1,
  not_found = 2,
  incorrect_state = 3,
  failed = 4,
  // Those of single requests, numbered as there.
  no_world_loaded = 101,       ///< unload_scenario, reload_scenario
  name_not_unique = 101,       ///< spawn_entity
  name_invalid = 102,          ///< spawn_entity
  resource_parse_error = 103,  ///< load_scenario: the scenario file
  no_resource = 104,           ///< spawn_entity: no such mesh file
  missing_assets = 104,        ///< load_scenario: a file that it names is not there
  unsupported_assets = 105,    ///< load_scenario: a mesh or a robot that it names
  spawn_parse_error = 106,     ///< spawn_entity: the mesh, or what it is to be
};

struct ControlReply {
  std::uint64_t id = 0;
  ControlResult result = ControlResult::ok;
  std::string message;  ///< a whole sentence for a person
  TextArguments values;
};

/// What a request led to.
struct Outcome {
  ControlResult result = ControlResult::ok;
  std::string message{};
  TextArguments values{};
};

struct GetFeatures {};
struct GetState {};
struct SetState {
  SimulationState state{};
};
struct Step {
  std::uint64_t steps = 1;
};
struct Reset {
  bool spawned_only = false;  ///< scope 4: what was spawned goes, nothing else is reset
};
struct SetPace {
  Pace pace{};
  double factor = 1.0;
};
struct RegisterController {
  std::string name;
  double period_s = 0.0;
  double timeout_s = 10.0;
  std::vector<int> targets;  ///< see target_name()
};
struct UnregisterController {
  std::string name;
};
struct SetLevelOfDetail {
  int process = -1;  ///< index of the process, -1: all
  int level = 1;
};
struct ExplainPart {
  int component = -1;
};
struct GetEntities {
  std::string filter;    ///< name with * for any characters; empty: all
  std::string category;  ///< part, gripper, ground; empty: all
};
struct GetEntityState {
  int component = -1;
};
/// Of a Part; what is not given stays as it is.
struct SetEntityState {
  int component = -1;
  std::optional<Vec3> p_WB;
  std::optional<Mat3> R_WB;
  std::optional<Vec3> linear_velocity, angular_velocity;  ///< of the origin of B, in the world
};
struct Attach {
  int part = -1;
  int to = -1;
};
struct Detach {
  int part = -1;
};
using ControlAction = std::variant<GetFeatures, GetState, SetState, Step, Reset, SetPace, RegisterController,
                                   UnregisterController, ExplainPart, SetLevelOfDetail, GetEntities,
                                   GetEntityState, SetEntityState, Attach, Detach>;

/// Checks a request against the vocabulary and the cell.
std::variant<ControlAction, ControlReply> parse(const ControlRequest& request, const CellDescription& cell);

/// Whether parse() knows it; see host_requests.h for those of the host.
bool is_known_request(std::string_view name);
ControlReply unknown_request_reply(const ControlRequest& request);

/// The answer to get_features.
ControlReply features_reply(std::uint64_t id);

}  // namespace takt
