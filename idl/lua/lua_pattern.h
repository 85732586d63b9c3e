#pragma once
// Patterns of Lua (section 6.4.1 of its manual), matched with a bound: each step of a match is work of the sandbox, so
// that a pattern which backtracks without end is an error of the program. Messages are those of Lua.
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "idl/lua/lua_sandbox.h"

namespace takt {

class LuaPattern {
 public:
  /// Both texts must stay where they are while the pattern is used. The pattern comes without its anchor.
  LuaPattern(lua_State* L, std::string_view subject, std::string_view pattern)
      : L_(L), subject_(subject), pattern_(pattern) {}

  /// End of the match that begins at this place of the subject; npos if there is none.
  std::size_t match(std::size_t from);

  /// Pushes the captures of the match from `from` to `to`, the whole match if the pattern has none and `whole` is set.
  /// Returns their number.
  int push_captures(std::size_t from, std::size_t to, bool whole);
  /// Pushes capture `index`, from 0 on; the whole match for 0 if the pattern has none.
  void push_capture(std::size_t index, std::size_t from, std::size_t to);

  static constexpr std::size_t npos = std::string_view::npos;

 private:
  static constexpr std::size_t kMaxCaptures = 32;
  static constexpr int kMaxDepth = 200;
  static constexpr std::size_t kOpen = npos, kPosition = npos - 1;
  struct Capture {
    std::size_t begin, length;  ///< kOpen: not closed yet; kPosition: a place, not a text
  };

  std::size_t step(std::size_t s, std::size_t p);
  std::size_t open_capture(std::size_t s, std::size_t p, std::size_t length);
  std::size_t close_capture(std::size_t s, std::size_t p);
  std::size_t longest(std::size_t s, std::size_t p, std::size_t end);
  std::size_t shortest(std::size_t s, std::size_t p, std::size_t end);
  std::size_t balanced(std::size_t s, std::size_t p);
  std::size_t repeated(std::size_t s, char digit);
  std::size_t item_end(std::size_t p);
  bool item_matches(std::size_t s, std::size_t p, std::size_t end);
  bool set_matches(char c, std::size_t p, std::size_t end);
  char pattern_at(std::size_t p) const { return p < pattern_.size() ? pattern_[p] : '\0'; }
  void spend(std::size_t work) { spend_work(L_, work); }

  lua_State* L_;
  std::string_view subject_, pattern_;
  int depth_ = 0;
  std::size_t level_ = 0;
  std::array<Capture, kMaxCaptures> captures_{};
};

}  // namespace takt
