#include "client_lib/controller/lua_handles.h"

#include <stdexcept>

#include "client_lib/controller/lua_arguments.h"

namespace takt::controller {

void define_type(lua_State* L, const char* type, lua_CFunction index, std::span<const LuaCall> calls) {
  luaL_newmetatable(L, type);
  lua_newtable(L);
  for (const LuaCall& call : calls) {
    if (call.is_field()) continue;
    lua_pushcfunction(L, call.function);
    lua_setfield(L, -2, std::string(call.name()).c_str());
  }
  lua_setfield(L, -2, "methods");
  if (index != nullptr) {
    lua_pushcfunction(L, index);
  } else {
    lua_getfield(L, -1, "methods");
  }
  lua_setfield(L, -2, "__index");
  // Without an address.
  lua_pushstring(L, type);
  lua_pushcclosure(
      L, [](lua_State* state) { return lua_pushvalue(state, lua_upvalueindex(1)), 1; }, 1);
  lua_setfield(L, -2, "__tostring");
  lua_pop(L, 1);
}

void register_functions(lua_State* L, std::span<const LuaCall> calls) {
  for (const LuaCall& call : calls) lua_register(L, std::string(call.name()).c_str(), call.function);
}

int push_member(lua_State* L, std::span<const LuaCall> calls, std::string_view what, std::string_view hint) {
  const std::string_view key = to_name(L, 2);
  for (const LuaCall& call : calls) {
    if (call.name() != key) continue;
    if (call.is_field()) return call.function(L);
    luaL_getmetafield(L, 1, "methods");
    lua_pushvalue(L, 2);
    lua_rawget(L, -2);
    return 1;
  }
  refuse_key(what, key, join(calls, ", ", [](const LuaCall& call) {
                          return std::string(call.name());
                        }) + std::string(hint));
}

void push_handle(lua_State* L, const char* type, int index) {
  *static_cast<int*>(lua_newuserdatauv(L, sizeof(int), 0)) = index;
  luaL_setmetatable(L, type);
}

int to_handle(lua_State* L, const char* type, const char* hint) {
  const void* data = luaL_testudata(L, 1, type);
  if (data == nullptr) {
    throw std::runtime_error("a " + std::string(type) + " is needed in front of the colon, not a " +
                             luaL_typename(L, 1) + hint);
  }
  return *static_cast<const int*>(data);
}

void refuse_key(std::string_view what, std::string_view key, std::string_view known) {
  throw std::runtime_error(std::string(what) + " has no '" + std::string(key) + "'; it has " +
                           std::string(known));
}

void push_joints(lua_State* L, const ArmModel& arm, const JointArray& q) {
  lua_createtable(L, arm.joint_count(), 0);
  for (int i = 0; i < arm.joint_count(); ++i) {
    lua_pushnumber(L, q[static_cast<size_t>(i)]);
    lua_rawseti(L, -2, i + 1);
  }
}

}  // namespace takt::controller
