#include "idl/common/text.h"

#include <array>
#include <charconv>
#include <cinttypes>
#include <cstdio>

namespace takt {
namespace {

template <class... Format>
std::string text_of(double value, Format... format) {
  std::array<char, 400> text{};  // the largest number has 309 digits ahead of the point
  char* const end = std::to_chars(text.data(), text.data() + text.size(), value, format...).ptr;
  return {text.data(), end};
}

}  // namespace

std::string exact_text(double value) {
  return text_of(value);
}

std::string number_text(double value, int digits) {
  return text_of(value, std::chars_format::general, digits);
}

std::string fixed_text(double value, int decimals) {
  return text_of(value, std::chars_format::fixed, decimals);
}

std::string hexadecimal_text(std::uint64_t number) {
  char text[19];
  std::snprintf(text, sizeof text, "0x%016" PRIx64, number);
  return text;
}

std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string lower_text(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

}  // namespace takt
