#include "idl/lua/lua_call.h"

namespace takt {

std::string lua_call_table(std::span<const LuaCall> calls, std::string_view owner) {
  std::string table = "| name | meaning |\n|---|---|\n";
  for (const LuaCall& one : calls) {
    std::string before(*one.registered != '\0' ? "" : owner);
    if (!before.empty() && one.is_field()) before.back() = '.';
    table += "| `" + before + one.call + "` | " + one.doc + " |\n";
  }
  return table;
}

std::string lua_word_table(std::span<const LuaWord> words) {
  std::string table = "| option | meaning |\n|---|---|\n";
  for (const LuaWord& one : words) table += std::string("| `") + one.name + "` | " + one.doc + " |\n";
  return table;
}

}  // namespace takt
