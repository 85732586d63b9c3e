#include "idl/lua/lua_pattern.h"

#include <cctype>

namespace takt {

namespace {

constexpr std::size_t kCharactersPerStep =
    16;  ///< that are compared or skipped as fast as one step of a match

bool in_class(char c, char name) {
  const auto u = static_cast<unsigned char>(c);
  bool is = false;
  switch (std::tolower(static_cast<unsigned char>(name))) {
    case 'a':
      is = std::isalpha(u) != 0;
      break;
    case 'c':
      is = std::iscntrl(u) != 0;
      break;
    case 'd':
      is = std::isdigit(u) != 0;
      break;
    case 'g':
      is = std::isgraph(u) != 0;
      break;
    case 'l':
      is = std::islower(u) != 0;
      break;
    case 'p':
      is = std::ispunct(u) != 0;
      break;
    case 's':
      is = std::isspace(u) != 0;
      break;
    case 'u':
      is = std::isupper(u) != 0;
      break;
    case 'w':
      is = std::isalnum(u) != 0;
      break;
    case 'x':
      is = std::isxdigit(u) != 0;
      break;
    default:
      return name == c;
  }
  return std::isupper(static_cast<unsigned char>(name)) != 0 ? !is : is;
}

}  // namespace

std::size_t LuaPattern::match(std::size_t from) {
  depth_ = 0;
  level_ = 0;
  return step(from, 0);
}

std::size_t LuaPattern::step(std::size_t s, std::size_t p) {
  struct Depth {
    int& depth;
    ~Depth() { --depth; }
  };
  if (depth_ >= kMaxDepth) luaL_error(L_, "pattern too complex");
  const Depth deeper{++depth_};
  for (;;) {
    spend(1);
    if (p == pattern_.size()) return s;
    switch (pattern_[p]) {
      case '(':
        return pattern_at(p + 1) == ')' ? open_capture(s, p + 2, kPosition) : open_capture(s, p + 1, kOpen);
      case ')':
        return close_capture(s, p + 1);
      case '$':
        if (p + 1 == pattern_.size()) return s == subject_.size() ? s : npos;
        break;
      case '%': {
        const char kind = pattern_at(p + 1);
        if (kind == 'b') {
          s = balanced(s, p + 2);
          if (s == npos) return npos;
          p += 4;
          continue;
        }
        if (kind == 'f') {
          p += 2;
          if (pattern_at(p) != '[') luaL_error(L_, "missing '[' after '%%f' in pattern");
          const std::size_t end = item_end(p);
          const char before = s == 0 ? '\0' : subject_[s - 1],
                     here = s < subject_.size() ? subject_[s] : '\0';
          if (set_matches(before, p, end - 1) || !set_matches(here, p, end - 1)) return npos;
          p = end;
          continue;
        }
        if (kind >= '0' && kind <= '9') {
          s = repeated(s, kind);
          if (s == npos) return npos;
          p += 2;
          continue;
        }
        break;
      }
      default:
        break;
    }
    const std::size_t end = item_end(p);
    const char suffix = pattern_at(end);
    if (!item_matches(s, p, end)) {
      if (suffix != '*' && suffix != '?' && suffix != '-') return npos;
      p = end + 1;
      continue;
    }
    if (suffix == '*') return longest(s, p, end);
    if (suffix == '+') return longest(s + 1, p, end);
    if (suffix == '-') return shortest(s, p, end);
    if (suffix == '?') {
      const std::size_t with = step(s + 1, end + 1);
      if (with != npos) return with;
      p = end + 1;
      continue;
    }
    ++s;
    p = end;
  }
}

std::size_t LuaPattern::open_capture(std::size_t s, std::size_t p, std::size_t length) {
  if (level_ >= kMaxCaptures) luaL_error(L_, "too many captures");
  captures_[level_++] = {s, length};
  const std::size_t end = step(s, p);
  if (end == npos) --level_;
  return end;
}

std::size_t LuaPattern::close_capture(std::size_t s, std::size_t p) {
  std::size_t open = level_;
  while (open > 0 && captures_[open - 1].length != kOpen) --open;
  if (open == 0) luaL_error(L_, "invalid pattern capture");
  Capture& capture = captures_[open - 1];
  capture.length = s - capture.begin;
  const std::size_t end = step(s, p);
  if (end == npos) capture.length = kOpen;
  return end;
}

std::size_t LuaPattern::longest(std::size_t s, std::size_t p, std::size_t end) {
  std::size_t count = 0;
  while (item_matches(s + count, p, end)) ++count;
  for (;; --count) {
    const std::size_t found = step(s + count, end + 1);
    if (found != npos || count == 0) return found;
  }
}

std::size_t LuaPattern::shortest(std::size_t s, std::size_t p, std::size_t end) {
  for (;; ++s) {
    const std::size_t found = step(s, end + 1);
    if (found != npos) return found;
    if (!item_matches(s, p, end)) return npos;
  }
}

std::size_t LuaPattern::balanced(std::size_t s, std::size_t p) {
  if (p + 1 >= pattern_.size()) luaL_error(L_, "malformed pattern (missing arguments to '%%b')");
  const char begin = pattern_[p], end = pattern_[p + 1];
  if (s >= subject_.size() || subject_[s] != begin) return npos;
  std::size_t open = 1;
  for (std::size_t i = s + 1; i < subject_.size(); ++i) {
    spend(1);
    if (subject_[i] == end) {
      if (--open == 0) return i + 1;
    } else if (subject_[i] == begin) {
      ++open;
    }
  }
  return npos;
}

std::size_t LuaPattern::repeated(std::size_t s, char digit) {
  const auto index = static_cast<std::size_t>(digit - '1');  // '0' is far beyond all
  if (index >= level_ || captures_[index].length == kOpen)
    luaL_error(L_, "invalid capture index %%%d", digit - '0');
  const Capture& capture = captures_[index];
  if (capture.length == kPosition || subject_.size() - s < capture.length) return npos;
  spend(capture.length / kCharactersPerStep);
  const bool same = subject_.substr(s, capture.length) == subject_.substr(capture.begin, capture.length);
  return same ? s + capture.length : npos;
}

/// Place behind the item that begins at `p`, without its suffix.
std::size_t LuaPattern::item_end(std::size_t p) {
  const std::size_t begin = p;
  const char kind = pattern_[p++];
  if (kind == '%') {
    if (p == pattern_.size()) luaL_error(L_, "malformed pattern (ends with '%%')");
    return p + 1;
  }
  if (kind != '[') return p;
  if (pattern_at(p) == '^') ++p;
  do {  // a bracket at the begin of a set is one of its characters
    if (p == pattern_.size()) luaL_error(L_, "malformed pattern (missing ']')");
    if (pattern_[p++] == '%' && p < pattern_.size()) ++p;
  } while (pattern_at(p) != ']');
  spend((p - begin) / kCharactersPerStep);
  return p + 1;
}

bool LuaPattern::item_matches(std::size_t s, std::size_t p, std::size_t end) {
  spend(1);
  if (s >= subject_.size()) return false;
  switch (pattern_[p]) {
    case '.':
      return true;
    case '%':
      return in_class(subject_[s], pattern_[p + 1]);
    case '[':
      return set_matches(subject_[s], p, end - 1);
    default:
      return pattern_[p] == subject_[s];
  }
}

/// `p` is the place of the opening bracket, `end` that of the closing one.
bool LuaPattern::set_matches(char c, std::size_t p, std::size_t end) {
  spend((end - p) / kCharactersPerStep);
  const bool wanted = pattern_[p + 1] != '^';
  if (!wanted) ++p;
  const auto of = [](char character) { return static_cast<unsigned char>(character); };
  while (++p < end) {
    if (pattern_[p] == '%') {
      ++p;
      if (in_class(c, pattern_[p])) return wanted;
    } else if (pattern_[p + 1] == '-' && p + 2 < end) {
      p += 2;
      if (of(pattern_[p - 2]) <= of(c) && of(c) <= of(pattern_[p])) return wanted;
    } else if (pattern_[p] == c) {
      return wanted;
    }
  }
  return !wanted;
}

int LuaPattern::push_captures(std::size_t from, std::size_t to, bool whole) {
  const std::size_t count = level_ == 0 && whole ? 1 : level_;
  luaL_checkstack(L_, static_cast<int>(count), "too many captures");
  for (std::size_t i = 0; i < count; ++i) push_capture(i, from, to);
  return static_cast<int>(count);
}

void LuaPattern::push_capture(std::size_t index, std::size_t from, std::size_t to) {
  if (index >= level_) {
    if (index != 0) luaL_error(L_, "invalid capture index %%%d", static_cast<int>(index) + 1);
    lua_pushlstring(L_, subject_.data() + from, to - from);
    return;
  }
  const Capture& capture = captures_[index];
  if (capture.length == kOpen) luaL_error(L_, "unfinished capture");
  if (capture.length == kPosition)
    lua_pushinteger(L_, static_cast<lua_Integer>(capture.begin) + 1);
  else
    lua_pushlstring(L_, subject_.data() + capture.begin, capture.length);
}

}  // namespace takt
