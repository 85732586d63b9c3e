#include "server/runtime/requests/request_text.h"

#include "idl/common/utf8.h"

namespace takt {

std::string find_text_fault(const ControlRequest& request) {
  constexpr const char* kNeeded = "; texts are UTF-8 without control characters.";
  if (!validate_utf8(request.request))
    return "The request's name '" + utf8_sanitize(request.request, 64) + "' is no text" + kNeeded;
  for (const auto& [name, value] : request.arguments) {
    if (validate_utf8(name) && validate_utf8(value, LineBreaks::allow)) continue;
    return "The argument '" + utf8_sanitize(name, 64) + "' of the request '" + request.request +
           "' is no text: '" + utf8_sanitize(value, 100) + "'" + kNeeded;
  }
  return {};
}

ControlReply sanitize(ControlReply reply, std::size_t max_message_size, std::size_t max_value_size) {
  reply.message = utf8_sanitize(reply.message, max_message_size, LineBreaks::allow);
  for (auto& [name, value] : reply.values) {
    name = utf8_sanitize(name);
    value = utf8_sanitize(value, max_value_size, LineBreaks::allow);
  }
  return reply;
}

}  // namespace takt
