#pragma once
// A Lua 5.4 state for controller programs. It has no access to files, clocks, random numbers, other code or addresses;
// memory and work per update are bounded; tables are iterated in a fixed order. So the course of a program depends on
// the program and its inputs alone.
#include <stdexcept>
#include <string>

// Lua built as C++ has the names of C in some distributions, those of C++ in others (CMakeLists.txt).
#ifdef TAKT_LUA_HAS_C_NAMES
#include <lua.hpp>
#else
#include <lauxlib.h>
#include <lua.h>
#include <lualib.h>
#endif

namespace takt::controller {

/// Memory a program may use, and virtual-machine instructions it may execute between two waits of all its
/// routines.
inline constexpr std::size_t kLuaMemory_bytes = 64U << 20U;
inline constexpr long kLuaInstructionsPerUpdate = 1'000'000;

class LuaSandbox {
 public:
  /// `owner` is what lua_owner() returns in functions called from Lua.
  explicit LuaSandbox(void* owner);
  ~LuaSandbox();
  LuaSandbox(const LuaSandbox&) = delete;
  LuaSandbox& operator=(const LuaSandbox&) = delete;

  lua_State* state() const { return L_; }

  /// Runs the program's text. Throws std::runtime_error with file and line.
  void run(const std::string& text, const std::string& file);

  /// Restores the full allowance of instructions.
  void refill() { instructions_left_ = kLuaInstructionsPerUpdate; }

  /// Whole text of the error on top of the stack of `thread`: Lua's message and the lines of the calls.
  std::string error_text(lua_State* thread) const;

 private:
  static void* allocate(void* sandbox, void* block, std::size_t old_size, std::size_t new_size);
  static void count(lua_State* L, lua_Debug* activation);

  struct Header {
    LuaSandbox* sandbox;
    void* owner;
  };
  friend void* lua_owner(lua_State* L);

  Header header_;
  std::size_t bytes_ = 0;
  long instructions_left_ = kLuaInstructionsPerUpdate;
  lua_State* L_ = nullptr;  ///< last: making it allocates, which counts bytes
};

void* lua_owner(lua_State* L);

/// A C function for Lua from one that may throw: a std::exception becomes a Lua error with file and line of
/// the caller. (Lua's own errors and yields are not std::exceptions and pass through.)
template <int (*function)(lua_State*)>
int lua_entry(lua_State* L) {
  try {
    return function(L);
  } catch (const std::exception& error) {
    luaL_where(L, 1);
    lua_pushstring(L, error.what());
  }
  lua_concat(L, 2);
  return lua_error(L);
}

}  // namespace takt::controller
