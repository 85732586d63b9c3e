#pragma once
// Requests as data: each @request struct of idl/takt_requests.idl is a row (takt_request_table.h) with its
// name, when it is executed, what it changes, which results it may have, and the tables of its arguments and
// of its response. Server, client, command log and documentation take them from there.
#include <cstdint>
#include <span>
#include <string_view>

#include "idl/common/message.h"
#include "takt_enumerations.h"

namespace takt {

enum class RequestPhase : std::uint8_t {
  at_once,  ///< answered by the thread that receives it
  loop,     ///< executed between two steps
  query,    ///< executed between two steps, at most one before each step
  host,     ///< executed by the thread that exchanges what is simulated
};

enum class RequestChanges : std::uint8_t {
  nothing,
  bits,  ///< what is simulated: it is in the command log and is replayed
  effect,  ///< the same, but the log has records of its own for what comes of it: resets, saved and restored states
  model,  ///< the scenario: it belongs to what a log and a session say of what is loaded
};

struct RequestInfo {
  std::string_view name;
  RequestPhase phase;
  RequestChanges changes;
  bool renews_state, renews_status;  ///< samples sent before its execution do not show the present
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
