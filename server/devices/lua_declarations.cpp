#include "server/devices/lua_declarations.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "idl/common/text.h"

namespace takt::lua_device {
namespace {

constexpr double kWidest = std::numeric_limits<double>::max();
constexpr LuaWord kLower{"lower", "least value"}, kUpper{"upper", "largest value"},
    kUnit{"unit", "unit, for reports and clients"}, kType{"type", "`real` (default), `integer` or `boolean`"},
    kInitial{"initial", "value at the start; default 0"};
constexpr LuaWord kParameterOptions[] = {kLower, kUpper, kUnit};
constexpr LuaWord kInputOptions[] = {kUnit, kType, kLower, kUpper, kInitial};
constexpr LuaWord kOutputOptions[] = {
    kUnit, kType, kInitial, {"state", "the differential state that the signal is, at each instant"}};
constexpr LuaWord kDifferentialOptions[] = {
    kInitial, {"scale", "typical size, for solvers with error control; default 1"}};

/// The table of options at `index`, with the names that are allowed.
void check_options(lua_State* L, int index, std::span<const LuaWord> known) {
  if (lua_isnoneornil(L, index)) return;
  if (!lua_istable(L, index))
    throw std::runtime_error(std::string("a table of options is needed, not a ") + luaL_typename(L, index));
  for (lua_pushnil(L); lua_next(L, index) != 0; lua_pop(L, 1)) {
    const std::string name = lua_type(L, -2) == LUA_TSTRING ? lua_tostring(L, -2) : "a value without a name";
    if (std::none_of(known.begin(), known.end(), [&](const LuaWord& word) { return name == word.name; }))
      throw std::runtime_error("option '" + name + "' is unknown; known are " +
                               join(known, ", ", [](const LuaWord& word) { return word.name; }));
  }
}
/// Pushes the option; false, and pushes nothing, if it is not given.
bool option(lua_State* L, int index, const char* name) {
  if (lua_isnoneornil(L, index)) return false;
  lua_getfield(L, index, name);
  if (!lua_isnil(L, -1)) return true;
  lua_pop(L, 1);
  return false;
}
double number_option(lua_State* L, int index, const char* name, double otherwise) {
  if (!option(L, index, name)) return otherwise;
  const double value = number_at(L, -1, name);
  lua_pop(L, 1);
  return value;
}
}  // namespace

std::string text_at(lua_State* L, int index, const char* what) {
  if (lua_type(L, index) != LUA_TSTRING)
    throw std::runtime_error(std::string(what) + ": a text is needed, not a " + luaL_typename(L, index));
  std::size_t length = 0;
  const char* text = lua_tolstring(L, index, &length);
  if (length == 0 || length > 100)
    throw std::runtime_error(std::string(what) + ": 1 to 100 bytes are allowed");
  return {text, length};
}

std::string name_at(lua_State* L, int index, const char* what) {
  std::string name = text_at(L, index, what);
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  if (!std::all_of(name.begin(), name.end(), good))
    throw std::runtime_error(std::string(what) + " '" + name + "': letters, digits and _ are allowed");
  return name;
}

double number_at(lua_State* L, int index, const std::string& what) {
  if (lua_type(L, index) != LUA_TNUMBER)
    throw std::runtime_error(what + ": a number is needed, not a " + luaL_typename(L, index));
  const double value = lua_tonumber(L, index);
  if (!std::isfinite(value)) throw std::runtime_error(what + ": the number is not finite");
  return value;
}

/// A number, or true and false as 1 and 0.
double signal_value_at(lua_State* L, int index, const SignalDescription& signal) {
  const std::string what = "signal '" + signal.name + "'";
  if (lua_isboolean(L, index)) {
    if (signal.type != SignalType::boolean)
      throw std::runtime_error(what + ": a number is needed, not a boolean");
    return lua_toboolean(L, index) != 0 ? 1.0 : 0.0;
  }
  const double value = number_at(L, index, what);
  if (signal.type == SignalType::boolean && value != 0.0 && value != 1.0)
    throw std::runtime_error(what + " is " + rounded_number(value) + "; allowed: true, false, 1, 0");
  if (signal.type == SignalType::integer && value != std::round(value))
    throw std::runtime_error(what + " is " + rounded_number(value) + "; allowed: a whole number");
  return value;
}

LuaStateValue state_value_at(lua_State* L, int index, const std::string& name) {
  const std::string what = "state '" + name + "'";
  if (lua_isboolean(L, index)) return lua_toboolean(L, index) != 0;
  if (lua_type(L, index) == LUA_TSTRING) {
    std::size_t length = 0;
    const char* text = lua_tolstring(L, index, &length);
    if (length > kLongestLuaText_bytes) throw std::runtime_error(what + ": a text has at most 64 bytes");
    return std::string(text, length);
  }
  if (lua_type(L, index) != LUA_TNUMBER)
    throw std::runtime_error(what + ": a number, a boolean or a text is needed, not a " +
                             luaL_typename(L, index));
  return number_at(L, index, what);
}

const char* type_name(const LuaStateValue& value) {
  return std::array{"number", "boolean", "text"}[value.index()];
}

[[noreturn]] void unknown(const std::string& what, const std::string& name, const std::string& known) {
  throw std::runtime_error(what + " '" + name +
                           "' does not exist; there are: " + (known.empty() ? "none" : known));
}

struct DeclaredNames {
  static constexpr LuaCall kDeclarations[] = {
      {"parameter(NAME, default [, options])", lua_entry<Declarations::declare_parameter>,
       "returns the number of the scenario, or the default"},
      {"input(NAME [, options])", lua_entry<Declarations::declare_input>, "a signal that clients set"},
      {"output(NAME [, options])", lua_entry<Declarations::declare_output>,
       "a signal that `step` sets, or that is a differential state"},
      {"state{NAME = value, ...}", lua_entry<Declarations::declare_state>,
       "what the device remembers: at most 64 numbers, booleans or texts up to 64 bytes"},
      {"differential(NAME [, options])", lua_entry<Declarations::declare_differential>,
       "a state of the system of differential equations"}};
};

void Declarations::begin(lua_State* L) {
  for (const LuaCall& call : DeclaredNames::kDeclarations)
    lua_register(L, std::string(call.name()).c_str(), call.function);
  lua_register(L, "print", lua_entry<print>);
}

std::string declarations_reference() {
  return lua_call_table(DeclaredNames::kDeclarations) + "\nOptions of `parameter`:\n\n" +
         lua_word_table(kParameterOptions) + "\nOptions of `input`:\n\n" + lua_word_table(kInputOptions) +
         "\nOptions of `output`:\n\n" + lua_word_table(kOutputOptions) + "\nOptions of `differential`:\n\n" +
         lua_word_table(kDifferentialOptions);
}

int Declarations::print(lua_State*) {
  throw std::runtime_error(
      "a device prints nothing; an output shows a value: output('seen'), and in step self.signals.seen = "
      "VALUE");
}

void Declarations::check_new(const std::string& name, const char* what) {
  if (!names_.insert(std::string(what) + name).second)
    throw std::runtime_error(std::string(what) + " '" + name + "' is declared twice");
}

int Declarations::declare_parameter(lua_State* L) {
  Declarations& self = of(L);
  const std::string name = name_at(L, 1, "the name of a parameter");
  double value = number_at(L, 2, "parameter '" + name + "'");
  check_options(L, 3, kParameterOptions);
  self.check_new(name, "parameter");
  const double lower = number_option(L, 3, "lower", -kWidest), upper = number_option(L, 3, "upper", kWidest);
  for (std::size_t i = 0; i < self.p_.parameters.size(); ++i) {
    if (self.p_.parameters[i].name != name) continue;
    value = self.p_.parameters[i].value;
    self.used_[i] = 1;
  }
  self.parameter_names_ += (self.parameter_names_.empty() ? "" : ", ") + name;
  if (!(value >= lower && value <= upper))
    throw std::runtime_error("parameter '" + name + "' is " + rounded_number(value) +
                             "; allowed: " + rounded_number(lower) + " to " + rounded_number(upper));
  lua_pushnumber(L, value);
  return 1;
}
int Declarations::declare_input(lua_State* L) {
  return of(L).declare_signal(L, true);
}
int Declarations::declare_output(lua_State* L) {
  return of(L).declare_signal(L, false);
}
int Declarations::declare_signal(lua_State* L, bool commanded) {
  const std::string name = name_at(L, 1, "the name of a signal");
  check_options(L, 2, commanded ? std::span<const LuaWord>(kInputOptions) : kOutputOptions);
  check_new(name, "signal");
  if (declared_.signals.size() == static_cast<std::size_t>(kMaxSignals))
    throw std::runtime_error("a device has at most " + std::to_string(kMaxSignals) + " signals");
  LuaDevice::Signal signal;
  signal.description.name = name;
  signal.description.commanded = commanded;
  if (option(L, 2, "unit")) {
    signal.description.unit = text_at(L, -1, "unit").substr(0, 32);
    lua_pop(L, 1);
  }
  if (option(L, 2, "type")) {
    const std::string type = text_at(L, -1, "type");
    lua_pop(L, 1);
    if (type == "boolean")
      signal.description.type = SignalType::boolean;
    else if (type == "integer")
      signal.description.type = SignalType::integer;
    else if (type != "real")
      throw std::runtime_error("type '" + type + "' of signal '" + name +
                               "'; allowed: real, integer, boolean");
  }
  const bool flag = signal.description.type == SignalType::boolean;
  if (commanded) {
    signal.description.lower = number_option(L, 2, "lower", flag ? 0.0 : -1e9);
    signal.description.upper = number_option(L, 2, "upper", flag ? 1.0 : 1e9);
    if (!(signal.description.lower < signal.description.upper))
      throw std::runtime_error("signal '" + name + "': lower is not below upper");
  }
  if (option(L, 2, "initial")) {
    signal.initial = signal_value_at(L, -1, signal.description);
    lua_pop(L, 1);
  } else if (commanded) {
    signal.initial = std::clamp(0.0, signal.description.lower, signal.description.upper);
  }
  if (commanded && (signal.initial < signal.description.lower || signal.initial > signal.description.upper))
    throw std::runtime_error("signal '" + name + "': initial is outside lower and upper");
  reported_.emplace_back();
  if (option(L, 2, "state")) {
    reported_.back() = text_at(L, -1, "state");
    lua_pop(L, 1);
  }
  declared_.signals.push_back(std::move(signal));
  return 0;
}
int Declarations::declare_state(lua_State* L) {
  Declarations& self = of(L);
  if (!lua_istable(L, 1)) throw std::runtime_error("state: a table of names and initial values is needed");
  if (!self.declared_.state.empty())
    throw std::runtime_error("state is declared twice; one table has all values");
  for (lua_pushnil(L); lua_next(L, 1) != 0; lua_pop(L, 1)) {
    std::string name = name_at(L, -2, "the name of a state");
    self.declared_.state.emplace_back(name, state_value_at(L, -1, name));
  }
  if (self.declared_.state.size() > kMostLuaState)
    throw std::runtime_error("state: at most " + std::to_string(kMostLuaState) + " values");
  std::sort(self.declared_.state.begin(), self.declared_.state.end());
  return 0;
}
int Declarations::declare_differential(lua_State* L) {
  Declarations& self = of(L);
  LuaDevice::Declaration::Differential d;
  d.name = name_at(L, 1, "the name of a differential state");
  check_options(L, 2, kDifferentialOptions);
  self.check_new(d.name, "differential state");
  d.initial = number_option(L, 2, "initial", 0.0);
  d.scale = number_option(L, 2, "scale", 1.0);
  if (!(d.scale > 0.0))
    throw std::runtime_error("scale: a positive number is needed, the typical size of the state");
  if (self.declared_.differential.size() == kMostLuaStates)
    throw std::runtime_error("a device has at most " + std::to_string(kMostLuaStates) +
                             " differential states");
  self.declared_.differential.push_back(std::move(d));
  return 0;
}
void Declarations::end(lua_State* L) {
  for (const LuaCall& call : DeclaredNames::kDeclarations) {
    lua_pushnil(L);
    lua_setglobal(L, std::string(call.name()).c_str());
  }
  for (std::size_t i = 0; i < used_.size(); ++i)
    if (used_[i] == 0) unknown("parameter", p_.parameters[i].name, parameter_names_);
  for (std::size_t i = 0; i < declared_.signals.size(); ++i) {
    if (reported_[i].empty()) continue;
    const int state = index_of(declared_.differential, reported_[i], [](const auto& d) { return d.name; });
    if (state < 0)
      unknown(p_.file + ": state of signal '" + declared_.signals[i].description.name + "':", reported_[i],
              join(declared_.differential, ", ", [](const auto& d) { return d.name; }));
    declared_.signals[i].state = state;
  }
  if (declared_.signals.empty())
    throw std::runtime_error(p_.file + ": no signal; input(NAME, {...}) and output(NAME, {...}) declare one");
}

}  // namespace takt::lua_device
