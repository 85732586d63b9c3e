#pragma once
// Numbers as tables and plots show them.
#include <array>
#include <cstdio>
#include <string>

namespace takt {

/// `value` in a format of printf for one double: nine digits unless another is given.
inline std::string number_text(double value, const char* format = "%.9g") {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace takt
