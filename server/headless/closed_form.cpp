#include "server/headless/closed_form.h"

#include <cmath>

#include "idl/lua/lua_sandbox.h"
#include "server/fields/scenario_error.h"

namespace takt {

double closed_form(const std::string& text, const std::map<std::string, double>& names,
                   const std::string& place) {
  constexpr const char* kResult = "closed_form";
  try {
    LuaSandbox sandbox(nullptr);
    lua_State* L = sandbox.state();
    lua_pushglobaltable(L);
    for (const auto& [name, value] : names) {
      lua_pushlstring(L, name.data(), name.size());
      lua_pushnumber(L, value);
      lua_rawset(L, -3);
    }
    const bool lines = text.find("return") != std::string::npos;
    sandbox.run(std::string(kResult) + " = (function() " + (lines ? "" : "return ") + text + "\nend)()",
                "formula");
    lua_pushstring(L, kResult);
    lua_rawget(L, -2);
    const double result = lua_type(L, -1) == LUA_TNUMBER ? lua_tonumber(L, -1) : std::nan("");
    if (std::isfinite(result)) return result;
  } catch (const std::runtime_error& error) {
    throw ScenarioError(place + ": found a formula with the error: " + error.what());
  }
  throw ScenarioError(place + ": found a formula without a finite number as result");
}

}  // namespace takt
