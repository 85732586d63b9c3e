#pragma once
// UTF-8 in external texts. Programs that read events and replies as JSON or in Python fail at invalid UTF-8,
// and terminals execute control characters. Lengths and positions are in bytes. Source: utf8cpp (RFC 3629: no
// overlong forms, no surrogates, no code points beyond U+10FFFF).
#include <cstddef>
#include <string>
#include <string_view>

namespace takt {

/// Line feed and tab: refused like other control characters, or allowed in the text.
enum class LineBreaks { refuse, allow };

/// Position of the first byte that belongs to no character; text.size() for valid UTF-8. Control characters
/// are valid.
std::size_t find_invalid_utf8(std::string_view text);

/// Whether the text is valid UTF-8 without control characters (those of ASCII and of Latin 1).
bool validate_utf8(std::string_view text, LineBreaks breaks = LineBreaks::refuse);

/// The text with a question mark in place of each byte for which validate_utf8() refuses it, cut between
/// characters to at most `max_size` bytes. The result is never longer than the text.
std::string utf8_sanitize(std::string_view text, std::size_t max_size = std::string_view::npos,
                          LineBreaks breaks = LineBreaks::refuse);

/// Size of the longest beginning of the text that has at most `max_size` bytes and ends between two
/// characters.
std::size_t utf8_prefix_size(std::string_view text, std::size_t max_size);

}  // namespace takt
