#pragma once
// The names that Lua texts of users may use, as tables: a table registers its names and is their reference (docs/lua.md,
// takt-run reference lua). A name without an explanation does not compile. Free of Lua's headers.
#include <span>
#include <string>
#include <string_view>

struct lua_State;

namespace takt {

/// A function, a method or a field.
struct LuaCall {
  const char* call;             ///< as it is written: "move_to(pose [, options])"; a field has no bracket
  int (*function)(lua_State*);  ///< of a field: pushes its value; nullptr: the text of the user defines it
  const char* doc;
  const char* registered;  ///< the name, where `call` does not begin with it: an operator

  consteval LuaCall(const char* written, int (*called)(lua_State*), const char* explanation,
                    const char* registered_name = "")
      : call(written), function(called), doc(explanation), registered(registered_name) {
    if (*doc == '\0') throw "a name needs an explanation";
  }
  constexpr std::string_view name() const {
    const std::string_view written = *registered != '\0' ? registered : call;
    return written.substr(0, written.find_first_of("({"));
  }
  constexpr bool is_field() const {
    return std::string_view(call).find_first_of("({*") == std::string_view::npos;
  }
};

/// A named value in a table of options.
struct LuaWord {
  const char* name;
  const char* doc;

  consteval LuaWord(const char* word, const char* explanation) : name(word), doc(explanation) {
    if (*doc == '\0') throw "a name needs an explanation";
  }
};

/// Rows of docs/lua.md with their head. `owner` stands in front of each name: "r:" of methods; fields have a point there.
std::string lua_call_table(std::span<const LuaCall> calls, std::string_view owner = "");
std::string lua_word_table(std::span<const LuaWord> words);

}  // namespace takt
