#pragma once
// A Lua 5.4 state for controller programs and for devices written in Lua. It has no access to files, clocks, random numbers, other code or addresses;
// memory and work per update are bounded; tables are iterated in a fixed order. So the course of a program depends on
// the program and its inputs alone.
#include <stdexcept>
#include <string>
#include <string_view>

// Lua built as C++ has the names of C in some distributions, those of C++ in others (CMakeLists.txt).
#ifdef TAKT_LUA_HAS_C_NAMES
#include <lua.hpp>
#else
#include <lauxlib.h>
#include <lua.h>
#include <lualib.h>
#endif

namespace takt {

/// Memory a program may use, length of one of its strings, and virtual-machine instructions it may execute between two
/// waits of all its routines. Library functions and memory count as instructions too (spend_work()).
inline constexpr std::size_t kLuaMemory_bytes = 64U << 20U;
inline constexpr std::size_t kLuaString_bytes = 1U << 20U;
inline constexpr long kLuaInstructionsPerUpdate = 1'000'000;

/// What is allowed to a text, and the sentences of its errors.
struct LuaLimits {
  std::size_t memory_bytes;
  std::string_view too_much_work, too_much_memory;
};
inline constexpr LuaLimits kLuaLimitsOfPrograms{
    kLuaMemory_bytes,
    "endless loop: more than 1000000 instructions without a wait, the work of library functions included",
    "not enough memory: a program may use 64 MB"};
inline constexpr LuaLimits kLuaLimitsOfDevices{
    16U << 20U,
    "endless loop: more than 1000000 instructions in one call, the work of library functions included",
    "not enough memory: a device may use 16 MB"};

/// Ends a function called from Lua with the error of a string beyond kLuaString_bytes.
[[noreturn]] void refuse_long_string(lua_State* L);

class LuaSandbox {
 public:
  /// `owner` is what lua_owner() returns in functions called from Lua.
  explicit LuaSandbox(void* owner, const LuaLimits& limits = kLuaLimitsOfPrograms);
  ~LuaSandbox();
  LuaSandbox(const LuaSandbox&) = delete;
  LuaSandbox& operator=(const LuaSandbox&) = delete;

  lua_State* state() const { return L_; }

  /// Runs the program's text. Throws std::runtime_error with file and line.
  void run(const std::string& text, const std::string& file);

  /// Restores the full allowance of instructions.
  void refill() { instructions_left_ = kLuaInstructionsPerUpdate; }
  /// Names the thread whose lines the next instructions are, until the next call.
  void runs(lua_State* thread) { running_ = thread; }

  /// Whether the program has exceeded a limit: it cannot continue, whatever its calls returned.
  bool exceeded() const { return !exceeded_.empty(); }

  /// Whole text of the error on top of the stack of `thread`: Lua's message and the lines of the calls.
  std::string error_text(lua_State* thread) const;

 private:
  static void* allocate(void* sandbox, void* block, std::size_t old_size, std::size_t new_size);
  static void count(lua_State* L, lua_Debug* activation);
  static LuaSandbox& of(lua_State* L);

  /// From the first exceeded limit on each instruction fails, so that no pcall of the program can hold the error back.
  void exceed(std::string_view limit);
  [[noreturn]] void fail(lua_State* L);
  void refuse(std::size_t size, std::string_view limit);

  struct Header {
    LuaSandbox* sandbox;
    void* owner;
  };
  friend void* lua_owner(lua_State* L);
  friend void spend_work(lua_State* L, std::size_t work);
  friend void refuse_long_string(lua_State* L);

  Header header_;
  const LuaLimits limits_;
  std::size_t bytes_ = 0;
  std::size_t refused_bytes_ = 0;  ///< by the last call of the allocator; Lua asks again after a collection
  long instructions_left_ = kLuaInstructionsPerUpdate;
  lua_State* running_ = nullptr;
  std::string_view exceeded_;   ///< the limit, in words; empty: none
  char exceeded_at_[128] = {};  ///< file and line
  lua_State* L_ = nullptr;      ///< last: making it allocates, which counts bytes
};

void* lua_owner(lua_State* L);

/// Counts work of a function called from Lua as instructions: about ten nanoseconds each. Ends the function with an error
/// when the allowance is used up.
void spend_work(lua_State* L, std::size_t work);
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

}  // namespace takt
