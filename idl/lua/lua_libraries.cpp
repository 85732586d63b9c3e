#include "idl/lua/lua_libraries.h"

#include <algorithm>
#include <cctype>
#include <climits>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "idl/lua/lua_pattern.h"

namespace takt {

namespace {

constexpr std::size_t kBytesPerWork = 64, kValuesPerWork = 8;

std::string_view text_argument(lua_State* L, int index) {
  std::size_t length = 0;
  const char* text = luaL_checklstring(L, index, &length);
  return {text, length};
}

void push_text(lua_State* L, std::string_view text) {
  lua_pushlstring(L, text.data(), text.size());
}

void append(lua_State* L, std::string& text, std::string_view more) {
  if (more.size() > kLuaString_bytes - text.size()) refuse_long_string(L);
  spend_work(L, more.size() / kBytesPerWork);
  text += more;
}

/// Place of the subject that an argument names, from 0 on; beyond the end where it lies there.
std::size_t first_place(lua_State* L, int index, std::size_t length) {
  const lua_Integer place = luaL_optinteger(L, index, 1);
  if (place > 0) return static_cast<std::size_t>(place) - 1;
  if (place == 0 || place < -static_cast<lua_Integer>(length)) return 0;
  return length - static_cast<std::size_t>(-place);
}

/// Spends work with the length of the texts and the number of the arguments.
void spend_arguments(lua_State* L) {
  const int count = lua_gettop(L);
  std::size_t work = 1 + static_cast<std::size_t>(count) / kValuesPerWork;
  for (int i = 1; i <= count; ++i)
    if (lua_type(L, i) == LUA_TSTRING) work += lua_rawlen(L, i) / kBytesPerWork;
  spend_work(L, work);
}

/// A function of Lua that reads and makes no more than its arguments.
int call_bounded(lua_State* L) {
  spend_arguments(L);
  const int results = lua_tocfunction(L, lua_upvalueindex(1))(L);
  spend_work(L, static_cast<std::size_t>(std::max(results, 0)) / kValuesPerWork);
  return results;
}

int text_rep(lua_State* L) {
  const std::string_view text = text_argument(L, 1),
                         between = lua_isnoneornil(L, 3) ? "" : text_argument(L, 3);
  const lua_Integer times = luaL_checkinteger(L, 2);
  std::string result;
  if (times > 0 && !(text.empty() && between.empty())) {
    const std::size_t most = kLuaString_bytes / std::max<std::size_t>(1, text.size() + between.size()) + 1;
    if (static_cast<std::size_t>(times) > most) refuse_long_string(L);
    const std::size_t pieces = static_cast<std::size_t>(times);
    const std::size_t size = pieces * text.size() + (pieces - 1) * between.size();
    if (size > kLuaString_bytes) refuse_long_string(L);
    spend_work(L, size / kBytesPerWork + pieces / kValuesPerWork);
    result.reserve(size);
    for (std::size_t i = 0; i < pieces; ++i) {
      result += text;
      if (i + 1 < pieces) result += between;
    }
  }
  push_text(L, result);
  return 1;
}

int find_or_match(lua_State* L, bool find) {
  const std::string_view subject = text_argument(L, 1);
  std::string_view pattern = text_argument(L, 2);
  const std::size_t from = first_place(L, 3, subject.size());
  if (from > subject.size()) {
    luaL_pushfail(L);
    return 1;
  }
  spend_arguments(L);
  if (find && (lua_toboolean(L, 4) != 0 || pattern.find_first_of("^$*+?.([%-") == std::string_view::npos)) {
    const void* found =
        ::memmem(subject.data() + from, subject.size() - from, pattern.data(), pattern.size());
    if (found == nullptr) {
      luaL_pushfail(L);
      return 1;
    }
    const auto at = static_cast<lua_Integer>(static_cast<const char*>(found) - subject.data());
    lua_pushinteger(L, at + 1);
    lua_pushinteger(L, at + static_cast<lua_Integer>(pattern.size()));
    return 2;
  }
  const bool anchor = pattern.starts_with('^');
  if (anchor) pattern.remove_prefix(1);
  LuaPattern matcher(L, subject, pattern);
  for (std::size_t begin = from; begin <= subject.size(); ++begin) {
    const std::size_t end = matcher.match(begin);
    if (end != LuaPattern::npos) {
      if (!find) return matcher.push_captures(begin, end, true);
      lua_pushinteger(L, static_cast<lua_Integer>(begin) + 1);
      lua_pushinteger(L, static_cast<lua_Integer>(end));
      return matcher.push_captures(begin, end, false) + 2;
    }
    if (anchor) break;
  }
  luaL_pushfail(L);
  return 1;
}

int text_find(lua_State* L) {
  return find_or_match(L, true);
}

int text_match(lua_State* L) {
  return find_or_match(L, false);
}

/// Upvalues: subject, pattern, place of the next attempt, end of the last match (-1: there is none).
int next_match(lua_State* L) {
  const std::string_view subject = text_argument(L, lua_upvalueindex(1));
  LuaPattern matcher(L, subject, text_argument(L, lua_upvalueindex(2)));
  const lua_Integer last = lua_tointeger(L, lua_upvalueindex(4));
  for (auto begin = static_cast<std::size_t>(lua_tointeger(L, lua_upvalueindex(3))); begin <= subject.size();
       ++begin) {
    const std::size_t end = matcher.match(begin);
    if (end == LuaPattern::npos || static_cast<lua_Integer>(end) == last) continue;
    lua_pushinteger(L, static_cast<lua_Integer>(end));
    lua_copy(L, -1, lua_upvalueindex(3));
    lua_replace(L, lua_upvalueindex(4));
    return matcher.push_captures(begin, end, true);
  }
  return 0;
}

int text_gmatch(lua_State* L) {
  const std::string_view subject = text_argument(L, 1);
  text_argument(L, 2);
  const std::size_t from = std::min(first_place(L, 3, subject.size()), subject.size() + 1);
  spend_work(L, 1);
  lua_settop(L, 2);
  lua_pushinteger(L, static_cast<lua_Integer>(from));
  lua_pushinteger(L, -1);
  lua_pushcclosure(L, next_match, 4);
  return 1;
}

/// The replacement text of gsub with its %0 to %9 filled in.
void append_filled(lua_State* L, LuaPattern& matcher, std::string& result, std::string_view subject,
                   std::size_t begin, std::size_t end) {
  const std::string_view text = text_argument(L, 3);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t plain = std::min(text.find('%', i), text.size());
    append(L, result, text.substr(i, plain - i));
    i = plain;
    if (i == text.size()) return;
    spend_work(L, 1);
    const char kind = ++i < text.size() ? text[i] : '\0';
    if (kind == '%') {
      append(L, result, "%");
    } else if (kind == '0') {
      append(L, result, subject.substr(begin, end - begin));
    } else if (std::isdigit(static_cast<unsigned char>(kind)) != 0) {
      matcher.push_capture(static_cast<std::size_t>(kind - '1'), begin, end);
      append(L, result, text_argument(L, -1));
      lua_pop(L, 1);
    } else {
      luaL_error(L, "invalid use of '%c' in replacement string", '%');
    }
  }
}

int text_gsub(lua_State* L) {
  const std::string_view subject = text_argument(L, 1);
  std::string_view pattern = text_argument(L, 2);
  const int kind = lua_type(L, 3);
  const bool is_text = kind == LUA_TSTRING || kind == LUA_TNUMBER;
  if (!is_text && kind != LUA_TFUNCTION && kind != LUA_TTABLE) luaL_typeerror(L, 3, "string/function/table");
  const lua_Integer most = luaL_optinteger(L, 4, static_cast<lua_Integer>(subject.size()) + 1);
  const bool anchor = pattern.starts_with('^');
  if (anchor) pattern.remove_prefix(1);
  spend_arguments(L);
  LuaPattern matcher(L, subject, pattern);
  std::string result;
  std::size_t at = 0, last = LuaPattern::npos;
  lua_Integer count = 0;
  while (count < most) {
    const std::size_t end = matcher.match(at);
    if (end != LuaPattern::npos && end != last) {
      ++count;
      if (is_text) {
        append_filled(L, matcher, result, subject, at, end);
      } else {
        if (kind == LUA_TFUNCTION) {
          lua_pushvalue(L, 3);
          lua_call(L, matcher.push_captures(at, end, true), 1);
        } else {
          matcher.push_capture(0, at, end);
          lua_gettable(L, 3);
        }
        if (lua_toboolean(L, -1) == 0)
          append(L, result, subject.substr(at, end - at));
        else if (lua_isstring(L, -1) != 0)
          append(L, result, text_argument(L, -1));
        else
          luaL_error(L, "invalid replacement value (a %s)", luaL_typename(L, -1));
        lua_pop(L, 1);
      }
      at = last = end;
    } else if (at < subject.size()) {
      append(L, result, subject.substr(at++, 1));
    } else {
      break;
    }
    if (anchor) break;
  }
  if (at < subject.size()) append(L, result, subject.substr(at));
  push_text(L, result);
  lua_pushinteger(L, count);
  return 2;
}

/// Length of the table that is the first argument.
lua_Integer table_length(lua_State* L) {
  luaL_checktype(L, 1, LUA_TTABLE);
  spend_arguments(L);
  return luaL_len(L, 1);
}

int table_insert(lua_State* L) {
  const lua_Integer length = table_length(L);
  const auto end = static_cast<lua_Integer>(static_cast<lua_Unsigned>(length) + 1);
  lua_Integer place = end;
  if (lua_gettop(L) == 3) {
    place = luaL_checkinteger(L, 2);
    luaL_argcheck(L, static_cast<lua_Unsigned>(place) - 1U < static_cast<lua_Unsigned>(end), 2,
                  "position out of bounds");
    for (lua_Integer i = end; i > place; --i) {
      spend_work(L, 1);
      lua_geti(L, 1, i - 1);
      lua_seti(L, 1, i);
    }
  } else if (lua_gettop(L) != 2) {
    return luaL_error(L, "wrong number of arguments to 'insert'");
  }
  lua_seti(L, 1, place);
  return 0;
}

int table_remove(lua_State* L) {
  const lua_Integer length = table_length(L);
  lua_Integer place = luaL_optinteger(L, 2, length);
  if (place != length)
    luaL_argcheck(L, static_cast<lua_Unsigned>(place) - 1U <= static_cast<lua_Unsigned>(length), 2,
                  "position out of bounds");
  lua_geti(L, 1, place);
  for (; place < length; ++place) {
    spend_work(L, 1);
    lua_geti(L, 1, place + 1);
    lua_seti(L, 1, place);
  }
  lua_pushnil(L);
  lua_seti(L, 1, place);
  return 1;
}

int table_concat(lua_State* L) {
  const lua_Integer length = table_length(L);
  const std::string_view between = lua_isnoneornil(L, 2) ? "" : text_argument(L, 2);
  const lua_Integer last = luaL_optinteger(L, 4, length);
  std::string result;
  for (lua_Integer i = luaL_optinteger(L, 3, 1); i <= last; ++i) {
    spend_work(L, 1);
    lua_geti(L, 1, i);
    if (lua_isstring(L, -1) == 0)
      return luaL_error(L, "invalid value (%s) at index %I in table for 'concat'", luaL_typename(L, -1),
                        static_cast<LUAI_UACINT>(i));
    append(L, result, text_argument(L, -1));
    lua_pop(L, 1);
    if (i == last) break;  // the largest integer has no next one
    append(L, result, between);
  }
  push_text(L, result);
  return 1;
}

int table_unpack(lua_State* L) {
  const lua_Integer first = luaL_optinteger(L, 2, 1),
                    last = lua_isnoneornil(L, 3) ? luaL_len(L, 1) : luaL_checkinteger(L, 3);
  if (first > last) return 0;
  const lua_Unsigned more = static_cast<lua_Unsigned>(last) - static_cast<lua_Unsigned>(first);
  if (more >= LUAI_MAXSTACK || lua_checkstack(L, static_cast<int>(more + 1)) == 0)
    return luaL_error(L, "too many results to unpack");
  spend_work(L, more + 1);
  for (lua_Integer i = first; i < last; ++i) lua_geti(L, 1, i);
  lua_geti(L, 1, last);
  return static_cast<int>(more) + 1;
}

int table_move(lua_State* L) {
  const lua_Integer first = luaL_checkinteger(L, 2), last = luaL_checkinteger(L, 3),
                    place = luaL_checkinteger(L, 4);
  const int target = lua_isnoneornil(L, 5) ? 1 : 5;
  luaL_checktype(L, 1, LUA_TTABLE);
  luaL_checktype(L, target, LUA_TTABLE);
  if (last >= first) {
    luaL_argcheck(L, first > 0 || last < LUA_MAXINTEGER + first, 3, "too many elements to move");
    const lua_Integer count = last - first + 1;
    luaL_argcheck(L, place <= LUA_MAXINTEGER - count + 1, 4, "destination wrap around");
    const bool rising = place > last || place <= first || (target != 1 && lua_rawequal(L, 1, target) == 0);
    for (lua_Integer i = 0; i < count; ++i) {
      spend_work(L, 1);
      const lua_Integer offset = rising ? i : count - 1 - i;
      lua_geti(L, 1, first + offset);
      lua_seti(L, target, place + offset);
    }
  }
  lua_pushvalue(L, target);
  return 1;
}

/// Whether value `a` of the table at `values` comes before value `b`; the second argument compares, if there is one.
bool sorts_before(lua_State* L, int values, lua_Integer a, lua_Integer b) {
  std::size_t work = 1;
  const bool own = !lua_isnoneornil(L, 2);
  if (own) lua_pushvalue(L, 2);
  lua_rawgeti(L, values, a);
  lua_rawgeti(L, values, b);
  for (const int place : {-1, -2})
    if (lua_type(L, place) == LUA_TSTRING) work += lua_rawlen(L, place) / kBytesPerWork;
  spend_work(L, work);
  if (own) lua_call(L, 2, 1);
  const bool before = (own ? lua_toboolean(L, -1) : lua_compare(L, -2, -1, LUA_OPLT)) != 0;
  lua_pop(L, own ? 1 : 2);
  return before;
}

int table_sort(lua_State* L) {
  const lua_Integer length = table_length(L);
  if (length < 2) return 0;
  luaL_argcheck(L, length < INT_MAX, 1, "array too big");
  if (!lua_isnoneornil(L, 2)) luaL_checktype(L, 2, LUA_TFUNCTION);
  lua_settop(L, 2);
  spend_work(L, static_cast<std::size_t>(length));
  lua_createtable(L, static_cast<int>(length), 0);
  constexpr int kValues = 3;
  std::vector<lua_Integer> order, merged;
  for (lua_Integer i = 1; i <= length; ++i) {
    lua_geti(L, 1, i);
    lua_rawseti(L, kValues, i);
    order.push_back(i);
  }
  // Runs of doubled length each round. An order that contradicts itself gives some order, and no fault.
  const std::size_t count = order.size();
  for (std::size_t run = 1; run < count; run *= 2) {
    merged.clear();
    for (std::size_t begin = 0; begin < count; begin += 2 * run) {
      const std::size_t middle = std::min(begin + run, count), end = std::min(begin + 2 * run, count);
      std::size_t left = begin, right = middle;
      while (left < middle || right < end) {
        const bool take_right =
            right < end && (left == middle || sorts_before(L, kValues, order[right], order[left]));
        merged.push_back(order[take_right ? right++ : left++]);
      }
    }
    order.swap(merged);
  }
  for (std::size_t i = 0; i < count; ++i) {
    lua_rawgeti(L, kValues, order[i]);
    lua_seti(L, 1, static_cast<lua_Integer>(i) + 1);
  }
  return 0;
}

/// Lets the functions of the table on top of the stack spend work with their arguments.
void bound_all(lua_State* L) {
  std::vector<std::string> names;
  for (lua_pushnil(L); lua_next(L, -2) != 0; lua_pop(L, 1))
    if (lua_iscfunction(L, -1) != 0) names.emplace_back(lua_tostring(L, -2));
  for (const std::string& name : names) {
    lua_getfield(L, -1, name.c_str());
    lua_pushcclosure(L, call_bounded, 1);
    lua_setfield(L, -2, name.c_str());
  }
}

}  // namespace

void bound_libraries(lua_State* L) {
  constexpr luaL_Reg kTexts[] = {{"rep", text_rep},       {"find", text_find}, {"match", text_match},
                                 {"gmatch", text_gmatch}, {"gsub", text_gsub}, {nullptr, nullptr}};
  constexpr luaL_Reg kTables[] = {
      {"insert", table_insert}, {"remove", table_remove}, {"concat", table_concat}, {"unpack", table_unpack},
      {"move", table_move},     {"sort", table_sort},     {nullptr, nullptr}};
  constexpr luaL_Reg kNone[] = {{nullptr, nullptr}};
  const std::pair<const char*, const luaL_Reg*> libraries[] = {
      {LUA_STRLIBNAME, kTexts}, {LUA_TABLIBNAME, kTables}, {LUA_UTF8LIBNAME, kNone}};
  for (const auto& [name, own] : libraries) {
    lua_getglobal(L, name);
    bound_all(L);
    luaL_setfuncs(L, own, 0);
    lua_pop(L, 1);
  }
  for (const char* name : {"select", "tonumber", "assert"}) {
    lua_getglobal(L, name);
    lua_pushcclosure(L, call_bounded, 1);
    lua_setglobal(L, name);
  }
}

}  // namespace takt
