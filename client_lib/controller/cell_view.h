#pragma once
// The global `cell` of programs, read-only: the message takt_msgs::msg::CellState of the present update, and as
// `cell.description` the message CellDescription. Programs read both by the field tables of the IDL: each field of
// idl/takt_msgs.idl is a name for programs.
//
// A number, a truth value, a text, an enumeration (its name), an index of the description (the name, or nil), a vector and
// a list of numbers are values: they keep the bits of the time of reading. Other messages and lists of messages are paths
// into the message (a robot of the cell), and show the present update at every reading.
#include "idl/lua/lua_sandbox.h"

namespace takt::controller {

/// Adds the global `cell`. lua_owner() is the Program.
void open_cell_view(lua_State* L);

/// Pushes the value that stands for the cell.
void push_cell(lua_State* L);

}  // namespace takt::controller
