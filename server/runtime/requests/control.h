#pragma once
// Control requests in the server: by name with typed values as they arrive, checked against the table
// (takt_requests.idl) and the cell, executed by one function per request, and answered.
#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include "idl/vocabulary/arguments.h"
#include "server/runtime/requests/entity_infos.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"
#include "server/simulation/step/explanation.h"

namespace takt {

struct ControlRequest {
  std::uint64_t id = 0;  ///< chosen by the submitter, returned in the reply
  std::string request;
  Arguments arguments;
};

struct ControlReply {
  std::uint64_t id = 0;
  ControlResult result = ControlResult::ok;
  std::string message;  ///< a whole sentence for a person
  Arguments values{};
};

/// Reason why a request is not executed, as in its reply.
struct Refusal {
  ControlResult result = ControlResult::failed;
  std::string message;
};

/// Result of a request: a sentence and the response, or a refusal.
template <Request Type>
struct Outcome {
  Outcome(std::string sentence, ResponseOf<Type> values = {})
      : result(ControlResult::ok), message(std::move(sentence)), response(std::move(values)) {}
  Outcome(Refusal refusal) : result(refusal.result), message(std::move(refusal.message)) {}

  bool ok() const { return result == ControlResult::ok; }
  ControlReply reply(std::uint64_t id) const {
    return {id, result, message, ok() ? arguments_of(response) : Arguments{}};
  }

  ControlResult result;
  std::string message;
  ResponseOf<Type> response{};
};

/// `cell`: of the loaded scenario, against which names are checked; nullptr: no scenario is loaded.
std::variant<requests::Any, Refusal> parse(const ControlRequest& request, const CellDescription* cell);

/// As a request travels and is stored.
ControlRequest control_request(const requests::Any& request);

// Answers that depend on their arguments alone.

requests::GetFeaturesResponse features();
Outcome<requests::GetEntities> entities(const requests::GetEntities& request, const CellDescription& cell,
                                        const EntityInfos& infos);
Outcome<requests::GetEntityState> entity_state(int component, const Snapshot& snapshot,
                                               const CellDescription& cell);
/// `sign`: 1 on the base, -1 on the target.
takt_msgs::msg::ContactResultant resultant_of(const ContactSample& pair, double sign);
Outcome<requests::ExplainPart> explanation(const Explanation& explanation, const CellDescription& cell);

}  // namespace takt
