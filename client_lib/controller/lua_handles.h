#pragma once
// Handles of the program for elements of the cell: an index, whose metatable is the kind of element.
#include <span>
#include <string>
#include <string_view>

#include "idl/common/text.h"
#include "idl/lua/lua_call.h"
#include "idl/lua/lua_sandbox.h"
#include "plant_models/robot/arm_kinematics.h"

namespace takt::controller {

/// Makes a type of handle. `index` answers handle.NAME; without one the methods do, which are the calls that are no fields.
void define_type(lua_State* L, const char* type, lua_CFunction index, std::span<const LuaCall> calls);

/// As globals.
void register_functions(lua_State* L, std::span<const LuaCall> calls);

/// In `index` of a handle: pushes the field or method that argument 2 names. `what` is the handle in the error.
int push_member(lua_State* L, std::span<const LuaCall> calls, std::string_view what,
                std::string_view hint = "");

void push_handle(lua_State* L, const char* type, int index);

/// The index in the handle that is argument 1. Throws if the argument has another type; `hint` proposes the remedy.
int to_handle(lua_State* L, const char* type, const char* hint = "");

[[noreturn]] void refuse_key(std::string_view what, std::string_view key, std::string_view known);

/// Joint positions as a list.
void push_joints(lua_State* L, const ArmModel& arm, const JointArray& q);

/// Index of the element of that name. The error begins with `none`, "the cell has no robot", and lists the names there are.
template <typename Items, typename NameOf>
int index_by_name(const Items& items, std::string_view name, std::string_view none, NameOf name_of) {
  for (size_t i = 0; i < items.size(); ++i)
    if (name_of(items[i]) == name) return static_cast<int>(i);
  const std::string names = join(items, ", ", name_of);
  throw std::runtime_error(std::string(none) + " '" + std::string(name) + "'; it has " +
                           (names.empty() ? "none" : names));
}
template <typename Items>
int index_by_name(const Items& items, std::string_view name, std::string_view none) {
  return index_by_name(items, name, none, [](const auto& item) { return std::string_view(item.name); });
}

}  // namespace takt::controller
