#pragma once
// Texts that came from outside, before they are told to others: valid UTF-8 without control characters.
// Programs that read events and replies as JSON or in Python end on anything else, and terminals obey it.
#include <cstddef>
#include <string>
#include <string_view>

#include "server/runtime/requests/control.h"

namespace takt {

/// `kept`: of control characters, line feed and tab are let through.
enum class Lines { replaced, kept };

/// The text with a question mark for every control character and every byte that is no UTF-8, cut between
/// characters so that it has at most `most` bytes. It never gets longer.
std::string plain_text(std::string_view text, std::size_t most = std::string_view::npos,
                       Lines lines = Lines::replaced);

/// Whether plain_text() would leave it as it is.
bool is_plain(std::string_view text, Lines lines = Lines::replaced);

/// How many bytes of the text, at most `most`, end between two characters.
std::size_t whole_characters(std::string_view text, std::size_t most);

/// What is wrong with the texts of a request, as a sentence; empty if nothing is.
std::string fault_of_texts(const ControlRequest& request);

/// The reply as it may go out.
ControlReply plain_reply(ControlReply reply, std::size_t most_of_message = std::string_view::npos,
                         std::size_t most_of_value = std::string_view::npos);

}  // namespace takt
