#pragma once
// Matches names with patterns: * stands for any number of characters, including zero; every other character
// stands for itself. By fnmatch(3), in a time of at most pattern times name.
#include <fnmatch.h>

#include <array>
#include <string>

namespace takt {

inline bool glob_match(const std::string& pattern, const std::string& name) {
  if (pattern.find_first_of("?[") == std::string::npos)
    return ::fnmatch(pattern.c_str(), name.c_str(), FNM_NOESCAPE) == 0;
  std::string literal;  // brackets make the other special characters of fnmatch literal
  for (const char c : pattern) literal += c == '?' || c == '[' ? std::string{'[', c, ']'} : std::string(1, c);
  return ::fnmatch(literal.c_str(), name.c_str(), FNM_NOESCAPE) == 0;
}

/// Whether the names fit the patterns in either order.
inline bool glob_match(const std::array<std::string, 2>& patterns, const std::string& a,
                       const std::string& b) {
  return (glob_match(patterns[0], a) && glob_match(patterns[1], b)) ||
         (glob_match(patterns[1], a) && glob_match(patterns[0], b));
}

}  // namespace takt
