#include "idl/common/uri.h"

#include "idl/common/text.h"

namespace takt {

std::string without_escapes(std::string_view text) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string code = text[i] == '%' ? lower_text(text.substr(i + 1, 2)) : "";
    if (code.size() == 2 && code.find_first_not_of(digits) == code.npos) {
      result += static_cast<char>(digits.find(code[0]) * 16 + digits.find(code[1]));
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

}  // namespace takt
