#pragma once
// Arguments of functions called from the program, checked. All errors are std::runtime_error for lua_entry().
#include <span>
#include <string_view>

#include "idl/lua/lua_sandbox.h"

namespace takt::controller {

struct NamedNumber {
  std::string_view name;
  double* value = nullptr;  ///< unchanged if the option is not given
};

/// Reads a table of named numbers; nothing given counts as an empty table. Refuses unknown names, values that
/// are not finite numbers, and anything but a table.
void read_options(lua_State* L, int index, std::span<const NamedNumber> known);

/// A named number of a struct of options, with its explanation.
template <typename Options>
struct LuaOption {
  const char* name;
  double Options::*value;
  const char* doc;

  consteval LuaOption(const char* word, double Options::*member, const char* explanation)
      : name(word), value(member), doc(explanation) {
    if (*doc == '\0') throw "an option needs an explanation";
  }
};

template <typename Options, std::size_t Count>
Options to_options(lua_State* L, int index, const LuaOption<Options> (&known)[Count]) {
  Options options;
  NamedNumber numbers[Count];
  for (std::size_t i = 0; i < Count; ++i) numbers[i] = {known[i].name, &(options.*known[i].value)};
  read_options(L, index, numbers);
  return options;
}

/// A finite number; `what` names the argument in the error.
double to_number(lua_State* L, int index, std::string_view what);

/// A string (not a number).
std::string_view to_name(lua_State* L, int index);

}  // namespace takt::controller
