#include <map>
#include <set>

#include "client_lib/controller/program.h"
#include "idl/lua/lua_sandbox.h"
#include "server/devices/lua_device.h"
#include "server/headless/reference_pages.h"

namespace takt {

namespace {

/// Functions and numbers of the library on top of the stack, in the order of their names; those of tables by table.
std::map<std::string, std::set<std::string>> names_of_sandbox() {
  const LuaSandbox sandbox(nullptr);
  lua_State* L = sandbox.state();
  std::map<std::string, std::set<std::string>> names;
  lua_pushglobaltable(L);
  const int globals = lua_gettop(L);
  for (lua_pushnil(L); lua_next(L, globals) != 0; lua_pop(L, 1)) {
    const std::string name = lua_tostring(L, -2);
    if (!lua_istable(L, -1)) {
      names[""].insert(name);
    } else if (lua_rawequal(L, -1, globals) == 0) {
      const int table = lua_gettop(L);
      for (lua_pushnil(L); lua_next(L, table) != 0; lua_pop(L, 1))
        names[name].insert(name + "." + lua_tostring(L, -2));
    }
  }
  return names;
}

std::string million(std::size_t count) {
  return std::to_string(count / 1'000'000) + " 000 000";
}

}  // namespace

std::string lua_reference() {
  std::string page =
      "# Lua\n\n"
      "This page is made of the tables that register these names (`takt-run reference lua`). How they are "
      "used: "
      "[robot programs](controller_programs.md), [devices in Lua](lua_devices.md).\n\n"
      "## Robot programs\n\n" +
      controller::program_reference() + "\n## Devices\n\n" + lua_device_reference() +
      "\n## Lua's own library\n\nBoth have these names of Lua 5.4; a device has no `print`.\n\n| library | "
      "names |\n|---|---|\n";
  for (const auto& [library, names] : names_of_sandbox()) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "`" : ", `") + name + "`";
    page += "| " + (library.empty() ? "global" : library) + " | " + list + " |\n";
  }
  const std::string memory = std::to_string(kLuaLimitsOfPrograms.memory_bytes >> 20U);
  page += "\n## Limits\n\n| | robot program | device |\n|---|---|---|\n| memory | " + memory + " MB | " +
          std::to_string(kLuaLimitsOfDevices.memory_bytes >> 20U) + " MB |\n| one string | " +
          std::to_string(kLuaString_bytes >> 20U) + " MB | the same |\n| instructions | " +
          million(kLuaInstructionsPerUpdate) + " between two waits | " + million(kLuaInstructionsPerUpdate) +
          " in one call |\n";
  return page;
}

}  // namespace takt
