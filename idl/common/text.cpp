#include "idl/common/text.h"

#include <array>
#include <charconv>

namespace takt {

std::string exact_text(double value) {
  std::array<char, 32> text{};
  char* const end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace takt
