#pragma once
// Texts of requests and replies: valid UTF-8 without control characters (idl/common/utf8.h). Values may have
// line feeds and tabs. Lengths are in bytes.
#include <cstddef>
#include <string>

#include "server/runtime/requests/control.h"

namespace takt {

/// A sentence that names the first invalid text of a request; empty if all are valid.
std::string find_text_fault(const ControlRequest& request);

/// The reply as it may go out: invalid bytes replaced, the message cut to its largest size.
ControlReply sanitize(ControlReply reply, std::size_t max_message_size = std::string::npos);

}  // namespace takt
