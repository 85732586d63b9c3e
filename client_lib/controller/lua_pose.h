#pragma once
// Poses as values of the program: pose{x=, y=, z=, roll=, pitch=, yaw=} (m, rad, fixed axes), products,
// inverse, offset. A pose never changes.
#include <string>

#include "idl/lua/lua_sandbox.h"
#include "plant_models/spatial.h"

namespace takt::controller {

/// Adds the global `pose` to the program's names.
void open_pose_library(lua_State* L);

/// Its part of docs/lua.md.
std::string pose_reference();

void push_pose(lua_State* L, const Pose& X);

/// Throws std::runtime_error where argument `index` is not a pose.
Pose to_pose(lua_State* L, int index);

}  // namespace takt::controller
