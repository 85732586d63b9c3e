#include "client_lib/controller/lua_arguments.h"

#include <cmath>
#include <string>

#include "idl/common/text.h"

namespace takt::controller {

namespace {

constexpr std::size_t kLongestName_bytes = 1000;

const NamedNumber& find_option(std::string_view name, std::span<const NamedNumber> known) {
  for (const NamedNumber& option : known) {
    if (option.name == name) return option;
  }
  throw std::runtime_error("'" + std::string(name) + "' is not known here; known are " + list_names(known));
}
}  // namespace

void read_options(lua_State* L, int index, std::span<const NamedNumber> known) {
  if (lua_isnoneornil(L, index)) return;
  if (!lua_istable(L, index)) {
    throw std::runtime_error("a table {" + list_names(known) + "} is needed, not a " +
                             luaL_typename(L, index));
  }
  lua_pushnil(L);
  while (lua_next(L, index) != 0) {
    if (lua_type(L, -2) != LUA_TSTRING) {
      throw std::runtime_error("every value needs its name: {" + std::string(known.front().name) +
                               " = ...}; known are " + list_names(known));
    }
    const NamedNumber& option = find_option(to_name(L, -2), known);
    *option.value = to_number(L, -1, option.name);
    lua_pop(L, 1);
  }
}

double to_number(lua_State* L, int index, std::string_view what) {
  if (lua_type(L, index) != LUA_TNUMBER) {
    throw std::runtime_error(std::string(what) + ": a number is needed, not a " + luaL_typename(L, index));
  }
  const double value = lua_tonumber(L, index);
  if (!std::isfinite(value)) throw std::runtime_error(std::string(what) + ": the number is not finite");
  return value;
}

std::string_view to_name(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TSTRING) {
    throw std::runtime_error("a name in quotes is needed, not a " + std::string(luaL_typename(L, index)));
  }
  std::size_t length = 0;
  const char* text = lua_tolstring(L, index, &length);
  if (length > kLongestName_bytes) throw std::runtime_error("a name has at most 1000 bytes");
  return {text, length};
}

}  // namespace takt::controller
