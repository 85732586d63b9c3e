#include "server/runtime/requests/plain_text.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace takt {
namespace {

bool continues(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

/// Bytes of the character at the beginning of a text that is not empty; 0 when it is none of UTF-8 (cut off,
/// longer than needed, half of a surrogate pair, beyond U+10FFFF).
std::size_t character_bytes(std::string_view text, std::uint32_t& code) {
  struct Length {
    unsigned char mask, head;
    std::uint32_t least;  // what needs so many bytes
  };
  constexpr Length kLengths[] = {
      {0x80, 0x00, 0}, {0xE0, 0xC0, 0x80}, {0xF0, 0xE0, 0x800}, {0xF8, 0xF0, 0x10000}};
  const auto first = static_cast<unsigned char>(text.front());
  for (std::size_t i = 0; i < std::size(kLengths); ++i) {
    if ((first & kLengths[i].mask) != kLengths[i].head) continue;
    if (text.size() <= i) return 0;
    code = first & static_cast<unsigned char>(~kLengths[i].mask);
    for (std::size_t at = 1; at <= i; ++at) {
      if (!continues(text[at])) return 0;
      code = code << 6U | (static_cast<unsigned char>(text[at]) & 0x3FU);
    }
    const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
    return code < kLengths[i].least || surrogate || code > 0x10FFFF ? 0 : i + 1;
  }
  return 0;
}

/// The same, and none of a control character: those of ASCII, and of Latin 1, which terminals obey too.
std::size_t plain_bytes(std::string_view text, Lines lines) {
  std::uint32_t code = 0;
  const std::size_t bytes = character_bytes(text, code);
  if (lines == Lines::kept && (code == '\n' || code == '\t')) return bytes;
  return code < 0x20 || (code >= 0x7F && code < 0xA0) ? 0 : bytes;
}

}  // namespace

std::string plain_text(std::string_view text, std::size_t most, Lines lines) {
  std::string plain(text.substr(0, whole_characters(text, most)));
  for (std::size_t at = 0; at < plain.size();) {
    const std::size_t bytes = plain_bytes(std::string_view(plain).substr(at), lines);
    if (bytes == 0) plain[at] = '?';
    at += std::max<std::size_t>(bytes, 1);
  }
  return plain;
}

bool is_plain(std::string_view text, Lines lines) {
  while (!text.empty()) {
    const std::size_t bytes = plain_bytes(text, lines);
    if (bytes == 0) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

std::size_t whole_characters(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text.size();
  constexpr std::size_t kMaxContinuing = 3;
  std::size_t end = most;
  while (end > 0 && most - end < kMaxContinuing && continues(text[end])) --end;
  return continues(text[end]) ? most : end;  // no character at all
}

std::string fault_of_texts(const ControlRequest& request) {
  constexpr const char* kNeeded = "; texts are UTF-8 without control characters.";
  if (!is_plain(request.request))
    return "The request's name '" + plain_text(request.request, 64) + "' is no text" + kNeeded;
  for (const auto& [name, value] : request.arguments) {
    // Overrides of a scenario come one a line.
    if (is_plain(name) && is_plain(value, Lines::kept)) continue;
    return "The argument '" + plain_text(name, 64) + "' of the request '" + request.request +
           "' is no text: '" + plain_text(value, 100) + "'" + kNeeded;
  }
  return {};
}

ControlReply plain_reply(ControlReply reply, std::size_t most_of_message, std::size_t most_of_value) {
  reply.message = plain_text(reply.message, most_of_message, Lines::kept);
  for (auto& [name, value] : reply.values) {
    name = plain_text(name);
    value = plain_text(value, most_of_value, Lines::kept);
  }
  return reply;
}

}  // namespace takt
