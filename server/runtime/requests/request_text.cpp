#include "server/runtime/requests/request_text.h"

#include "idl/common/utf8.h"

namespace takt {

std::string find_text_fault(const ControlRequest& request) {
  constexpr const char* kNeeded = "; texts are UTF-8 without control characters.";
  if (!validate_utf8(request.request))
    return "The request's name '" + utf8_sanitize(request.request, 64) + "' is no text" + kNeeded;
  for (const auto& [name, value] : request.arguments) {
    const std::string* invalid = validate_utf8(value.text, LineBreaks::allow) ? nullptr : &value.text;
    for (const std::string& text : value.texts)
      if (!validate_utf8(text, LineBreaks::allow)) invalid = &text;
    if (!validate_utf8(name)) invalid = &name;
    if (invalid == nullptr) continue;
    return "The argument '" + utf8_sanitize(name, 64) + "' of the request '" + request.request +
           "' is no text: '" + utf8_sanitize(*invalid, 100) + "'" + kNeeded;
  }
  return {};
}

ControlReply sanitize(ControlReply reply, std::size_t max_message_size) {
  const auto replace = [](std::string& text) {
    text = utf8_sanitize(text, std::string::npos, LineBreaks::allow);
  };
  reply.message = utf8_sanitize(reply.message, max_message_size, LineBreaks::allow);
  for (auto& [name, value] : reply.values) {
    name = utf8_sanitize(name);
    replace(value.text);
    for (std::string& text : value.texts) replace(text);
  }
  return reply;
}

}  // namespace takt
