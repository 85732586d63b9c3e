#pragma once
// Arguments of functions called from the program, checked. All errors are std::runtime_error for lua_entry().
#include <initializer_list>
#include <string_view>

#include "idl/lua/lua_sandbox.h"

namespace takt::controller {

struct NamedNumber {
  std::string_view name;
  double* value;  ///< unchanged if the option is not given
};

/// Reads a table of named numbers; nothing given counts as an empty table. Refuses unknown names, values that
/// are not finite numbers, and anything but a table.
void read_options(lua_State* L, int index, std::initializer_list<NamedNumber> known);

/// A finite number; `what` names the argument in the error.
double to_number(lua_State* L, int index, std::string_view what);

/// A string (not a number).
std::string_view to_name(lua_State* L, int index);

}  // namespace takt::controller
