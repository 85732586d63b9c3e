#pragma once
// Words of URScript text, with their lines and columns from 1 on.
#include <string>
#include <string_view>
#include <vector>

namespace takt::urscript {

struct Token {
  enum class Kind : unsigned char { name, keyword, number, text, symbol, end_of_line, end_of_text };
  Kind kind = Kind::end_of_text;
  std::string text{};   ///< without the quotes of a text
  double number = 0.0;  ///< of a number
  bool whole = false;   ///< the number has neither point nor exponent
  int line = 1, column = 1;
};

/// Of names, which may begin with a letter.
inline bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
inline bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Comments and program labels ($ 2 "MoveJ") are left out. The last token is end_of_text. Throws ScriptError.
std::vector<Token> tokens_of(std::string_view text);

}  // namespace takt::urscript
