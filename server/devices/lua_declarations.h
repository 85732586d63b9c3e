#pragma once
// What the text of a Lua device declares, while it runs: parameter(), input(), output(), state() and differential(). All
// errors are std::runtime_error for lua_entry().
#include <span>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "idl/lua/lua_call.h"
#include "idl/lua/lua_sandbox.h"
#include "server/devices/lua_device.h"

namespace takt::lua_device {

// Arguments, checked.

/// A text of 1 to 100 bytes.
std::string text_at(lua_State* L, int index, const char* what);
/// Letters, digits and _.
std::string name_at(lua_State* L, int index, const char* what);
/// A finite number.
double number_at(lua_State* L, int index, const std::string& what);
/// A number of the signal's type, or true and false as 1 and 0.
double signal_value_at(lua_State* L, int index, const SignalDescription& signal);
LuaStateValue state_value_at(lua_State* L, int index, const std::string& name);
const char* type_name(const LuaStateValue& value);
[[noreturn]] void unknown(const std::string& what, const std::string& name, const std::string& known);

template <class Items, class NameOf>
int index_of(const Items& items, std::string_view name, NameOf name_of) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (name_of(items[i]) == name) return static_cast<int>(i);
  return -1;
}

/// What a text declares, as a section of docs/lua.md.
std::string declarations_reference();

/// The owner of the sandbox (lua_owner()), as a base class.
class Declarations {
 public:
  explicit Declarations(const LuaDeviceParameters& parameters)
      : p_(parameters), used_(parameters.parameters.size(), 0) {}

  const LuaDevice::Declaration& declared() const { return declared_; }

 protected:
  ~Declarations() = default;
  /// Makes the functions of the text, and takes them away when it has run.
  void begin(lua_State* L);
  void end(lua_State* L);

  const LuaDeviceParameters& p_;
  LuaDevice::Declaration declared_;

 private:
  friend struct DeclaredNames;
  static Declarations& of(lua_State* L) { return *static_cast<Declarations*>(lua_owner(L)); }
  static int declare_parameter(lua_State* L);
  static int declare_input(lua_State* L);
  static int declare_output(lua_State* L);
  static int declare_state(lua_State* L);
  static int declare_differential(lua_State* L);
  static int print(lua_State* L);
  int declare_signal(lua_State* L, bool commanded);
  void check_new(const std::string& name, const char* what);

  std::vector<std::string> reported_;  ///< by signal: name of its differential state
  std::vector<char> used_;             ///< by stated parameter
  std::string parameter_names_;
  std::unordered_set<std::string> names_;
};

}  // namespace takt::lua_device
