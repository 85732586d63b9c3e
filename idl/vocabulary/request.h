#pragma once
// Requests as data: each @request struct of idl/takt_requests.idl is a row (takt_request_table.h) with its
// name, its phase, its changes, its possible results, and the tables of its arguments and of its response.
// Server, client, command log and documentation use these rows.
#include <cstdint>
#include <span>
#include <string_view>

#include "idl/common/message.h"
#include "takt_enumerations.h"

namespace takt {

enum class RequestPhase : std::uint8_t {
  at_once,  ///< answered by the thread that receives it
  loop,     ///< executed between two steps
  query,    ///< executed between two steps, at most one per step
  host,     ///< executed by the thread that exchanges the scenario
};

enum class RequestChanges : std::uint8_t {
  nothing,
  bits,    ///< the simulated state: it is in the command log and is replayed
  effect,  ///< the same, but the log has other records for its effect: resets, saved and restored states
  model,   ///< the scenario: it is part of the loaded content in a log and a session
};

struct RequestInfo {
  std::string_view name;
  RequestPhase phase;
  RequestChanges changes;
  bool renews_state, renews_status;  ///< samples sent ahead of its execution are outdated
  std::span<const ControlResult> results;
  const MessageInfo* request;
  const MessageInfo* response;
};

/// Generated for each request: `Response`, `info`.
template <typename Type>
struct RequestTable;

template <typename Type>
concept Request = requires {
  RequestTable<Type>::info;
};

template <Request Type>
using ResponseOf = typename RequestTable<Type>::Response;

template <Request Type>
constexpr const RequestInfo& request_info() {
  return RequestTable<Type>::info;
}

}  // namespace takt
