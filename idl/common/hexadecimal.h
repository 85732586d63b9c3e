#pragma once
// A hash as text.
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <string>

namespace takt {

/// "0x" and 16 digits, as in all reports.
inline std::string hexadecimal(std::uint64_t number) {
  char text[19];
  std::snprintf(text, sizeof text, "0x%016" PRIx64, number);
  return text;
}

}  // namespace takt
