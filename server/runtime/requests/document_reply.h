#pragma once
// A reply whose values carry a text of any length: as a value holds at most 4096 characters, it comes in
// pieces document_0, document_1, ..., to be put together in order; `pieces` says how many.
#include <string>

#include "server/runtime/requests/control.h"

namespace takt {

/// False, and the reply is unchanged, when the text does not fit into the values of one reply.
bool add_document(ControlReply& reply, const std::string& text);

}  // namespace takt
