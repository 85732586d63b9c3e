#pragma once
// Pages of docs/ that are made from tables of the code: docs/signals.md from the kinds of devices and the signals of
// grippers, docs/lua.md from the names that Lua texts may use. A test compares them with these texts.
#include <string>

namespace takt {

std::string signals_reference();
std::string lua_reference();

}  // namespace takt
