#pragma once
// The global `cell` of programs: read-only values of the present update.
#include "client_lib/controller/lua_sandbox.h"

namespace takt::controller {

/// Adds the global `cell`. lua_owner() is the Program.
void open_cell_view(lua_State* L);

/// Pushes the value that stands for the cell.
void push_cell(lua_State* L);

}  // namespace takt::controller
