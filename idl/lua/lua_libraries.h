#pragma once
// Functions of Lua's libraries of strings, tables and UTF-8 whose work is bounded, with the results and the messages of
// Lua. Lua counts the instructions of its virtual machine alone, and one call of a library function may run for years:
// a pattern that backtracks, table.move over 2^62 elements, string.rep. Here each function spends the work of the
// sandbox (spend_work()) with the length of its texts, its elements and the steps of a match.
#include "idl/lua/lua_sandbox.h"

namespace takt {

/// Replaces the functions of the open libraries. The sort of tables is stable, unlike that of Lua, which takes a clock.
void bound_libraries(lua_State* L);

}  // namespace takt
