#include "idl/common/utf8.h"

#include <utf8cpp/utf8.h>

#include <algorithm>
#include <cstdint>

namespace takt {
namespace {

/// Calls `found(begin, end)` with each character of valid UTF-8 that is a refused control character.
template <class Iterator, class Found>
void find_control_characters(Iterator at, Iterator end, LineBreaks breaks, Found found) {
  while (at != end) {
    const Iterator begin = at;
    const std::uint32_t code = utf8::unchecked::next(at);
    if (breaks == LineBreaks::allow && (code == '\n' || code == '\t')) continue;
    if (code < 0x20 || (code >= 0x7F && code < 0xA0)) found(begin, at);
  }
}

}  // namespace

std::size_t find_invalid_utf8(std::string_view text) {
  const auto invalid = utf8::find_invalid(text.begin(), text.end());
  return static_cast<std::size_t>(invalid - text.begin());
}

bool validate_utf8(std::string_view text, LineBreaks breaks) {
  bool valid = utf8::find_invalid(text.begin(), text.end()) == text.end();
  if (valid) find_control_characters(text.begin(), text.end(), breaks, [&](auto, auto) { valid = false; });
  return valid;
}

std::string utf8_sanitize(std::string_view text, std::size_t max_size, LineBreaks breaks) {
  std::string result(text.substr(0, utf8_prefix_size(text, max_size)));
  for (auto at = result.begin(); at != result.end();) {
    const auto valid_end = utf8::find_invalid(at, result.end());
    find_control_characters(at, valid_end, breaks, [](auto begin, auto end) { std::fill(begin, end, '?'); });
    at = valid_end;
    if (at != result.end()) *at++ = '?';
  }
  return result;
}

std::size_t utf8_prefix_size(std::string_view text, std::size_t max_size) {
  if (text.size() <= max_size) return text.size();
  const auto continues = [&](std::size_t at) {
    return (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U;
  };
  constexpr std::size_t kMaxContinuing = 3;  // bytes of a character after its first
  std::size_t end = max_size;
  while (end > 0 && max_size - end < kMaxContinuing && continues(end)) --end;
  return continues(end) ? max_size : end;  // invalid UTF-8 has no better place
}

}  // namespace takt
