#pragma once
// The control vocabulary, that of simulation_interfaces 2.1: requests by name with arguments as text, checked
// here and turned into an action for the step loop. A request that is not known or not well-formed is
// answered at once.
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/runtime/event.h"
#include "server/runtime/pacer.h"
#include "server/simulation/cell_description.h"

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
};

struct ControlReply {
  std::uint64_t id = 0;
  ControlResult result = ControlResult::ok;
  std::string message;  ///< a whole sentence for a person
  TextArguments values;
};

struct GetFeatures {};
struct GetState {};
struct SetState {
  SimulationState state{};
};
struct Step {
  std::uint64_t steps = 1;
};
struct Reset {};
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
using ControlAction = std::variant<GetFeatures, GetState, SetState, Step, Reset, SetPace, RegisterController,
                                   UnregisterController, ExplainPart, SetLevelOfDetail>;

/// Checks a request against the vocabulary and the cell.
std::variant<ControlAction, ControlReply> parse(const ControlRequest& request, const CellDescription& cell);

/// The answer to get_features.
ControlReply features_reply(std::uint64_t id);

/// A number as text that reads back as the same bits.
std::string exact_text(double value);

}  // namespace takt
