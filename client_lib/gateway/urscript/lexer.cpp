#include "client_lib/gateway/urscript/lexer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "client_lib/gateway/urscript/value.h"

namespace takt::urscript {
namespace {

constexpr std::array<std::string_view, 26> kKeywords{
    "def",      "sec",    "thread", "end",   "if",   "elif", "else", "while", "break",
    "continue", "return", "global", "local", "and",  "or",   "xor",  "not",   "True",
    "False",    "true",   "false",  "run",   "join", "kill", "halt", "for"};
constexpr std::array<std::string_view, 4> kPairs{"==", "!=", "<=", ">="};

class Lexer {
 public:
  explicit Lexer(std::string_view text) : text_(text) {}

  std::vector<Token> read() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\n') {
        if (!tokens_.empty() && tokens_.back().kind != Token::Kind::end_of_line && nesting_ == 0)
          add(Token::Kind::end_of_line, "\n");
        ++at_;
        ++line_;
        line_begin_ = at_;
        label_allowed_ = true;
        continue;
      }
      if (c == ' ' || c == '\t' || c == '\r') {
        ++at_;
      } else if (c == '#' || (c == '$' && label_allowed_)) {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else {
        label_allowed_ = false;
        word(c);
      }
    }
    add(Token::Kind::end_of_line, "\n");
    add(Token::Kind::end_of_text, "");
    return std::move(tokens_);
  }

 private:
  int column() const { return static_cast<int>(at_ - line_begin_) + 1; }
  [[noreturn]] void fail(const std::string& what) const {
    throw ScriptError(line_, column(), "syntax_error: " + what);
  }
  Token& add(Token::Kind kind, std::string text) {
    tokens_.push_back({kind, std::move(text), 0.0, false, line_, column()});
    return tokens_.back();
  }

  void word(char c) {
    if (is_letter(c)) {
      std::size_t end = at_;
      while (end < text_.size() && (is_letter(text_[end]) || is_digit(text_[end]))) ++end;
      const std::string_view name = text_.substr(at_, end - at_);
      const bool keyword = std::find(kKeywords.begin(), kKeywords.end(), name) != kKeywords.end();
      add(keyword ? Token::Kind::keyword : Token::Kind::name, std::string(name));
      at_ = end;
    } else if (is_digit(c) || (c == '.' && at_ + 1 < text_.size() && is_digit(text_[at_ + 1]))) {
      number();
    } else if (c == '"' || c == '\'') {
      const std::size_t end = text_.find(c, at_ + 1);
      if (end == std::string_view::npos || text_.substr(at_, end - at_).find('\n') != std::string_view::npos)
        fail("a text has no end");
      if (end - at_ - 1 > Value::kMostTextBytes) fail("a text has too many bytes");
      add(Token::Kind::text, std::string(text_.substr(at_ + 1, end - at_ - 1)));
      at_ = end + 1;
    } else {
      symbol(c);
    }
  }

  void number() {
    double value = 0.0;
    std::size_t end = at_;
    while (end < text_.size() &&
           (is_digit(text_[end]) || text_[end] == '.' || text_[end] == 'e' || text_[end] == 'E' ||
            ((text_[end] == '+' || text_[end] == '-') && end > at_ &&
             (text_[end - 1] == 'e' || text_[end - 1] == 'E'))))
      ++end;
    const std::string_view digits = text_.substr(at_, end - at_);
    const auto [last, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (problem != std::errc{} || last != digits.data() + digits.size())
      fail(std::string(digits.substr(0, 80)) + " is no number; allowed: e.g. 1, 2.5, 1e-3");
    const bool whole = std::all_of(digits.begin(), digits.end(), is_digit);
    Token& token = add(Token::Kind::number, std::string(digits));
    token.number = value;
    token.whole = whole;
    at_ = end;
    if (at_ < text_.size() && is_letter(text_[at_])) fail("a letter after a number");
  }

  void symbol(char c) {
    const std::string_view pair = text_.substr(at_, 2);
    if (std::find(kPairs.begin(), kPairs.end(), pair) != kPairs.end()) {
      add(Token::Kind::symbol, std::string(pair));
      at_ += 2;
      return;
    }
    if (std::string_view("()[],:=+-*/%<>.").find(c) == std::string_view::npos)
      fail(std::string("the character '") + (c >= ' ' && c <= '~' ? std::string(1, c) : std::string("?")) +
           "' is not allowed here");
    if (c == '(' || c == '[') ++nesting_;
    if ((c == ')' || c == ']') && nesting_ > 0) --nesting_;
    // A line may go on within brackets; a statement's first word ends what has no closing bracket.
    add(Token::Kind::symbol, std::string(1, c));
    ++at_;
  }

  std::string_view text_;
  std::size_t at_ = 0, line_begin_ = 0;
  int line_ = 1, nesting_ = 0;
  bool label_allowed_ = true;
  std::vector<Token> tokens_{};
};

}  // namespace

std::vector<Token> tokens_of(std::string_view text) {
  return Lexer(text).read();
}

}  // namespace takt::urscript
