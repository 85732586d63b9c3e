#include "server/devices/lua_device.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "idl/common/text.h"
#include "server/devices/lua_declarations.h"
#include "server/devices/seeded_noise.h"

namespace takt {
namespace {

using namespace lua_device;

constexpr std::size_t kMostText_bytes = 1U << 20U;

/// Tables of the script whose contents are in LuaDevice: reading and writing them is checked.
enum class Proxy : lua_Integer { self, signals, state, x };

/// The functions that a text defines.
constexpr LuaCall kStep{
    "step(self, dt)", nullptr,
    "called once a step, after the commands and before the integration from `self.time` to "
    "`self.time + dt`"};
constexpr LuaCall kDerivatives{
    "derivatives(t, x, inputs, state)", nullptr,
    "called by the solver, any number of times; returns a table with the rate of each "
    "differential state. `inputs` has all signals. It changes nothing"};

}  // namespace

/// A Lua state with the text loaded, and the access of the script to the device.
class LuaDevice::Interpreter final : private Declarations {
 public:
  Interpreter(const LuaDeviceParameters& p, LuaDevice& device)
      : Declarations(p), device_(device), sandbox_(static_cast<Declarations*>(this), kLuaLimitsOfDevices) {
    lua_State* L = sandbox_.state();
    begin(L);
    sandbox_.run(p.text, p.file);
    end(L);
    make_proxies();
    declared_.has_step = keep_function(kStep.name(), step_);
    declared_.has_derivatives = keep_function(kDerivatives.name(), derivatives_);
    if (declared_.has_derivatives != !declared_.differential.empty())
      throw std::runtime_error(
          p.file + ": " +
          (declared_.has_derivatives
               ? "function derivatives without differential states; differential(NAME, {...}) declares one"
               : "differential states without a function derivatives(t, x, inputs, state)"));
    if (!declared_.has_step && !declared_.has_derivatives)
      throw std::runtime_error(
          p.file + ": neither a function step(self, dt) nor a function derivatives(t, x, inputs, state)");
    if (!declared_.has_step)
      for (const Signal& signal : declared_.signals)
        if (!signal.description.commanded && signal.state < 0)
          throw std::runtime_error(
              p.file + ": output '" + signal.description.name +
              "' is never set: it names no state, and there is no function step(self, dt)");
    fingerprint_ = fingerprint();
  }

  using Declarations::declared;
  bool broken() const { return sandbox_.exceeded(); }

  void step(double t, double* x, const CellMotion& motion) {
    lua_State* L = sandbox_.state();
    time_s_ = t, x_ = x, motion_ = &motion, stepping_ = true, changed_ = false;
    lua_rawgeti(L, LUA_REGISTRYINDEX, step_);
    push(Proxy::self);
    lua_pushnumber(L, p_.step_s);
    const std::string error = call(2, 0);
    stepping_ = false, motion_ = nullptr;
    if (!error.empty()) throw std::runtime_error(error);
    const long long steps = std::llround(t / p_.step_s);
    if ((steps < kWatchedSteps || steps % kWatchedPeriod == 0) && fingerprint() != fingerprint_)
      throw std::runtime_error(
          "device '" + p_.device + "': " + p_.file +
          ": step has changed a variable outside of self; what a device remembers is declared "
          "by state{...}, and is self.state");
  }
  /// Whether the last step has changed signals, state or x.
  bool changed() const { return changed_; }

  void derivatives(double t, const double* x, double* xdot) {
    lua_State* L = sandbox_.state();
    // Read only: `stepping_` is false.
    time_s_ = t, x_ = const_cast<double*>(x);
    lua_rawgeti(L, LUA_REGISTRYINDEX, derivatives_);
    lua_pushnumber(L, t);
    push(Proxy::x);
    push(Proxy::signals);
    push(Proxy::state);
    std::string error = call(4, 1);
    if (error.empty() && !lua_istable(L, -1)) error = where() + "derivatives returns no table";
    if (error.empty()) {
      for (std::size_t i = 0; i < declared_.differential.size() && error.empty(); ++i) {
        const std::string& name = declared_.differential[i].name;
        lua_pushlstring(L, name.data(), name.size());
        lua_rawget(L, -2);
        xdot[i] = lua_type(L, -1) == LUA_TNUMBER ? lua_tonumber(L, -1) : std::nan("");
        if (!std::isfinite(xdot[i]))
          error = where() + "derivatives returns no finite number for '" + name + "'";
        lua_pop(L, 1);
      }
    }
    lua_settop(L, 0);
    if (!error.empty()) throw std::runtime_error(error);
  }

 private:
  static Interpreter& of(lua_State* L) {
    return static_cast<Interpreter&>(*static_cast<Declarations*>(lua_owner(L)));
  }
  std::string where() const { return "device '" + p_.device + "': " + p_.file + ": "; }

  std::string call(int arguments, int results) {
    lua_State* L = sandbox_.state();
    sandbox_.refill();
    sandbox_.runs(L);
    if (lua_pcall(L, arguments, results, 0) == LUA_OK && !sandbox_.exceeded()) return {};
    std::string error = "device '" + p_.device + "': " + sandbox_.error_text(L);
    lua_settop(L, 0);
    return error;
  }
  bool keep_function(std::string_view name_in_table, int& reference) {
    const std::string name(name_in_table);
    lua_State* L = sandbox_.state();
    lua_pushglobaltable(L);
    lua_pushstring(L, name.c_str());
    lua_rawget(L, -2);
    const bool found = lua_isfunction(L, -1);
    if (!found && !lua_isnil(L, -1))
      throw std::runtime_error(p_.file + ": '" + name + "' is a " + luaL_typename(L, -1) +
                               "; a function is needed");
    if (found) reference = luaL_ref(L, LUA_REGISTRYINDEX);
    lua_settop(L, 0);
    return found;
  }

  // Access of the script.

  void make_proxies() {
    lua_State* L = sandbox_.state();
    for (const Proxy proxy : {Proxy::self, Proxy::signals, Proxy::state, Proxy::x}) {
      lua_newtable(L);
      lua_newtable(L);
      lua_pushinteger(L, static_cast<lua_Integer>(proxy));
      lua_pushcclosure(L, lua_entry<get>, 1);
      lua_setfield(L, -2, "__index");
      lua_pushinteger(L, static_cast<lua_Integer>(proxy));
      lua_pushcclosure(L, lua_entry<set>, 1);
      lua_setfield(L, -2, "__newindex");
      lua_setmetatable(L, -2);
      proxies_[static_cast<std::size_t>(proxy)] = luaL_ref(L, LUA_REGISTRYINDEX);
    }
  }
  void push(Proxy proxy) {
    lua_rawgeti(sandbox_.state(), LUA_REGISTRYINDEX, proxies_[static_cast<std::size_t>(proxy)]);
  }
  std::size_t signal_named(const std::string& name) const {
    const int i = index_of(declared_.signals, name, [](const Signal& s) { return s.description.name; });
    if (i < 0)
      unknown("signal", name,
              join(declared_.signals, ", ", [](const Signal& s) { return s.description.name; }));
    return static_cast<std::size_t>(i);
  }
  std::size_t state_named(const std::string& name) const {
    const int i = index_of(declared_.state, name, [](const auto& one) { return one.first; });
    if (i < 0) unknown("state", name, join(declared_.state, ", ", [](const auto& one) { return one.first; }));
    return static_cast<std::size_t>(i);
  }
  std::size_t differential_named(const std::string& name) const {
    const int i = index_of(declared_.differential, name, [](const auto& d) { return d.name; });
    if (i < 0)
      unknown("differential state", name,
              join(declared_.differential, ", ", [](const auto& d) { return d.name; }));
    return static_cast<std::size_t>(i);
  }

  static int get(lua_State* L) {
    Interpreter& self = of(L);
    spend_work(L, 4);
    const std::string name = text_at(L, 2, "a name");
    switch (static_cast<Proxy>(lua_tointeger(L, lua_upvalueindex(1)))) {
      case Proxy::self:
        return self.get_self(L, name);
      case Proxy::signals: {
        const std::size_t i = self.signal_named(name);
        const Signal& signal = self.declared_.signals[i];
        const double value = signal.state >= 0 ? self.x_[signal.state] : self.device_.signals_[i];
        if (signal.description.type == SignalType::boolean)
          lua_pushboolean(L, value != 0.0);
        else
          lua_pushnumber(L, value);
        return 1;
      }
      case Proxy::state: {
        const LuaStateValue& value = self.device_.state_[self.state_named(name)];
        if (const auto* number = std::get_if<double>(&value))
          lua_pushnumber(L, *number);
        else if (const auto* flag = std::get_if<bool>(&value))
          lua_pushboolean(L, *flag);
        else
          lua_pushlstring(L, std::get<std::string>(value).data(), std::get<std::string>(value).size());
        return 1;
      }
      case Proxy::x:
        lua_pushnumber(L, self.x_[self.differential_named(name)]);
        return 1;
    }
    return 0;
  }
  int get_self(lua_State* L, const std::string& name) {
    for (const LuaCall& call : SelfNames::kSelf)
      if (call.name() == name)
        return call.is_field() ? call.function(L) : (lua_pushcfunction(L, call.function), 1);
    unknown("self", name,
            join(SelfNames::kSelf, ", ", [](const LuaCall& call) { return std::string(call.name()); }));
  }
  template <Proxy proxy>
  static int push_proxy(lua_State* L) {
    return of(L).push(proxy), 1;
  }
  static int push_time(lua_State* L) { return lua_pushnumber(L, of(L).time_s_), 1; }
  static int set(lua_State* L) {
    Interpreter& self = of(L);
    spend_work(L, 4);
    const std::string name = text_at(L, 2, "a name");
    if (!self.stepping_) throw std::runtime_error("derivatives changes nothing; step(self, dt) may");
    switch (static_cast<Proxy>(lua_tointeger(L, lua_upvalueindex(1)))) {
      case Proxy::self:
        throw std::runtime_error("self." + name +
                                 " cannot be set; what a device remembers is declared by state{...}, "
                                 "and is self.state." +
                                 name);
      case Proxy::signals: {
        const std::size_t i = self.signal_named(name);
        const Signal& signal = self.declared_.signals[i];
        if (signal.description.commanded)
          throw std::runtime_error("signal '" + name + "' is an input, which clients set");
        if (signal.state >= 0)
          throw std::runtime_error("signal '" + name + "' is the differential state '" +
                                   self.declared_.differential[static_cast<std::size_t>(signal.state)].name +
                                   "'");
        self.assign(self.device_.signals_[i], signal_value_at(L, 3, signal.description));
        return 0;
      }
      case Proxy::state: {
        LuaStateValue& value = self.device_.state_[self.state_named(name)];
        LuaStateValue next = state_value_at(L, 3, name);
        if (next.index() != value.index())
          throw std::runtime_error("state '" + name + "' is a " + type_name(value) + " and becomes a " +
                                   type_name(next));
        self.assign(value, std::move(next));
        return 0;
      }
      case Proxy::x:
        self.assign(self.x_[self.differential_named(name)], number_at(L, 3, "state '" + name + "'"));
        return 0;
    }
    return 0;
  }
  template <class T>
  void assign(T& to, T value) {
    if (to == value) return;
    to = std::move(value);
    changed_ = true;
  }
  const CellMotion& motion() const {
    if (motion_ == nullptr) throw std::runtime_error("positions and joints are read in step(self, dt) alone");
    return *motion_;
  }
  static int position(lua_State* L) {
    Interpreter& self = of(L);
    const std::string name = text_at(L, 2, "the name of a component");
    const int i = index_of(self.p_.components, name, [](const auto& one) { return one.name; });
    if (i < 0)
      unknown("component", name, join(self.p_.components, ", ", [](const auto& one) { return one.name; }));
    const auto body = static_cast<std::size_t>(self.p_.components[static_cast<std::size_t>(i)].index);
    const Vec3& p = self.motion().bodies[body].X_WB.p;
    for (const double coordinate : {p.x(), p.y(), p.z()}) lua_pushnumber(L, coordinate);
    return 3;
  }
  static int joints(lua_State* L) {
    Interpreter& self = of(L);
    const std::string name = text_at(L, 2, "the name of a robot");
    const int i = index_of(self.p_.robots, name, [](const auto& one) { return one.name; });
    if (i < 0) unknown("robot", name, join(self.p_.robots, ", ", [](const auto& one) { return one.name; }));
    const LuaDeviceParameters::Robot& robot = self.p_.robots[static_cast<std::size_t>(i)];
    lua_createtable(L, static_cast<int>(robot.joints), 0);
    for (std::size_t j = 0; j < robot.joints; ++j) {
      lua_pushnumber(L, self.motion().arms[static_cast<std::size_t>(robot.index)].q[j]);
      lua_rawseti(L, -2, static_cast<lua_Integer>(j) + 1);
    }
    return 1;
  }

  // All that the script can reach: variables of functions, and tables. Addresses are constant while the interpreter lives.

  static std::uint64_t mixed(std::uint64_t a, std::uint64_t b) { return splitmix64(splitmix64(a) + b); }
  std::uint64_t value_print(lua_State* L, int index) {
    const int type = lua_type(L, index);
    const auto kind = static_cast<std::uint64_t>(type) + 1;
    switch (type) {
      case LUA_TNUMBER:
        return mixed(kind + (lua_isinteger(L, index) != 0 ? 100 : 0),
                     lua_isinteger(L, index) != 0 ? static_cast<std::uint64_t>(lua_tointeger(L, index))
                                                  : std::bit_cast<std::uint64_t>(lua_tonumber(L, index)));
      case LUA_TBOOLEAN:
        return mixed(kind, static_cast<std::uint64_t>(lua_toboolean(L, index)));
      case LUA_TSTRING: {
        std::size_t length = 0;
        const char* text = lua_tolstring(L, index, &length);
        // Of equal short strings there is one.
        if (length <= kShortString) return mixed(kind, std::bit_cast<std::uintptr_t>(text));
        return mixed(kind, std::hash<std::string_view>{}({text, length}));
      }
      case LUA_TFUNCTION:
        if (lua_iscfunction(L, index) != 0)
          return mixed(kind, std::bit_cast<std::uintptr_t>(lua_topointer(L, index)));
        [[fallthrough]];
      case LUA_TTABLE:
        visit(L, index);
        return mixed(kind, std::bit_cast<std::uintptr_t>(lua_topointer(L, index)));
      default:
        return kind;
    }
  }
  void visit(lua_State* L, int index) {
    const void* address = lua_topointer(L, index);
    const auto place = std::lower_bound(seen_.begin(), seen_.end(), address, std::less<>());
    if (place != seen_.end() && *place == address) return;
    seen_.insert(place, address);
    if (++depth_ > kMostDepth || lua_checkstack(L, 6) == 0)
      throw std::runtime_error(where() + "tables and functions nest deeper than 100");
    const int at = lua_absindex(L, index);
    const auto own = static_cast<std::uint64_t>(std::bit_cast<std::uintptr_t>(lua_topointer(L, at)));
    if (lua_istable(L, at)) {
      for (lua_pushnil(L); lua_next(L, at) != 0; lua_pop(L, 1)) {
        const std::uint64_t key = value_print(L, lua_absindex(L, -2));
        sum_ += mixed(mixed(own, key), value_print(L, -1));  // a sum: the order of a table is not fixed
      }
    } else {
      for (int i = 1; lua_getupvalue(L, at, i) != nullptr; ++i) {
        sum_ += mixed(mixed(own, static_cast<std::uint64_t>(i)), value_print(L, -1));
        lua_pop(L, 1);
      }
    }
    --depth_;
  }
  std::uint64_t fingerprint() {
    lua_State* L = sandbox_.state();
    seen_.clear();
    sum_ = 0;
    depth_ = 0;
    lua_pushglobaltable(L);
    visit(L, -1);
    lua_settop(L, 0);
    for (const int reference : {step_, derivatives_}) {
      if (reference == LUA_NOREF) continue;
      lua_rawgeti(L, LUA_REGISTRYINDEX, reference);
      visit(L, -1);
      lua_settop(L, 0);
    }
    return sum_;
  }

  /// What `self` has.
  struct SelfNames {
    static constexpr LuaCall kSelf[] = {
        {"signals", push_proxy<Proxy::signals>, "signals by name: inputs can be read, outputs set"},
        {"state", push_proxy<Proxy::state>, "values of `state{...}` by name: read and set; the type stays"},
        {"x", push_proxy<Proxy::x>, "differential states by name; setting one is a jump"},
        {"time", push_time, "time of the step (s)"},
        {"position(COMPONENT)", lua_entry<position>, "x, y, z of the origin of a component in the world (m)"},
        {"joints(ROBOT)", lua_entry<joints>, "list of joint positions (rad or m)"}};
  };
  friend std::string takt::lua_device_reference();

  LuaDevice& device_;
  LuaSandbox sandbox_;
  std::array<int, 4> proxies_{};
  int step_ = LUA_NOREF, derivatives_ = LUA_NOREF;
  std::uint64_t fingerprint_ = 0, sum_ = 0;
  std::vector<const void*> seen_;  ///< sorted
  static constexpr int kMostDepth = 100;
  /// All variables are compared after each of the first steps, then at this period: that takes longer than a step of a device.
  static constexpr long long kWatchedSteps = 64, kWatchedPeriod = 8;
  static constexpr std::size_t kShortString = 40;  ///< Lua keeps one of each (LUAI_MAXSHORTLEN)
  int depth_ = 0;
  // Of the present call.
  double time_s_ = 0.0;
  double* x_ = nullptr;
  const CellMotion* motion_ = nullptr;
  bool stepping_ = false, changed_ = false;
};

std::string lua_device_reference() {
  const LuaCall functions[] = {kStep, kDerivatives};
  return declarations_reference() + "\nFunctions that the file defines, one or both:\n\n" +
         lua_call_table(functions) + "\nIn `step`:\n\n" +
         lua_call_table(LuaDevice::Interpreter::SelfNames::kSelf, "self:");
}

LuaDevice::LuaDevice(const LuaDeviceParameters& parameters) : p_(parameters) {
  lua_ = make_interpreter();
  declaration_ = lua_->declared();
  reset();
}
LuaDevice::~LuaDevice() = default;

std::unique_ptr<LuaDevice::Interpreter> LuaDevice::make_interpreter() {
  return std::make_unique<Interpreter>(p_, *this);
}

void LuaDevice::initial_state(double* x) const {
  for (const Declaration::Differential& d : declaration_.differential) *x++ = d.initial;
}

void LuaDevice::state_scales(double* scales) const {
  for (const Declaration::Differential& d : declaration_.differential) *scales++ = d.scale;
}

void LuaDevice::derivatives(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                            double* xdot) const {
  if (declaration_.has_derivatives) lua_->derivatives(t, x, xdot);
}

bool LuaDevice::decide(double t, double* x, const CellMotion& motion) {
  if (!started_) {
    started_ = true;
    return false;
  }
  if (!declaration_.has_step) return false;
  lua_->step(t, x, motion);
  return lua_->changed() && declaration_.has_derivatives;
}

void LuaDevice::reset() {
  if (lua_->broken()) lua_ = make_interpreter();
  started_ = false;
  signals_.clear();
  for (const Signal& signal : declaration_.signals) signals_.push_back(signal.initial);
  state_.clear();
  for (const auto& [name, value] : declaration_.state) state_.push_back(value);
}

void LuaDevice::set_signal(double, int signal, double value) {
  signals_[static_cast<std::size_t>(signal)] = value;
}

void LuaDevice::read_signals(double, const double* x, const CellMotion&, std::span<double> signals) const {
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    const int state = declaration_.signals[i].state;
    signals[i] = state >= 0 ? x[state] : signals_[i];
  }
}

std::uint64_t LuaDevice::discrete_hash() const {
  StateHash hash;
  hash.add(std::span<const double>(signals_));
  for (const LuaStateValue& value : state_) {
    hash.add(static_cast<std::uint64_t>(value.index()));
    if (const auto* number = std::get_if<double>(&value)) {
      hash.add(*number);
    } else if (const auto* flag = std::get_if<bool>(&value)) {
      hash.add(static_cast<std::uint64_t>(*flag));
    } else {
      const std::string& text = std::get<std::string>(value);
      hash.add(static_cast<std::uint64_t>(text.size()));
      for (const char letter : text) hash.add(static_cast<std::uint64_t>(static_cast<unsigned char>(letter)));
    }
  }
  return hash.value();
}

void LuaDevice::save(StateWriter& out) const {
  out.put(started_);
  out.put(std::span<const double>(signals_));
  for (const LuaStateValue& value : state_) {
    if (const auto* number = std::get_if<double>(&value))
      out.put(*number);
    else if (const auto* flag = std::get_if<bool>(&value))
      out.put(*flag);
    else
      out.put(std::string_view(std::get<std::string>(value)));
  }
}

void LuaDevice::load(StateReader& in) {
  if (lua_->broken()) lua_ = make_interpreter();
  started_ = in.flag("'a Lua device has started'");
  in.numbers(signals_, "a signal of a Lua device");
  for (LuaStateValue& value : state_) {
    if (auto* number = std::get_if<double>(&value)) {
      *number = in.number("a number of a Lua device's state");
    } else if (auto* flag = std::get_if<bool>(&value)) {
      *flag = in.flag("'a flag of a Lua device's state'");
    } else {
      std::get<std::string>(value) = in.text(kLongestLuaText_bytes, "a text of a Lua device's state");
    }
  }
}

void describe(Fields& f, ScenarioLuaDevice& s) {
  f.field("file", s.file, f.file(), "Text of the device in Lua, relative to the scenario file.", kRequired);
  f.field("parameters", s.parameters, NumberMap{},
          "Values of the parameters that the file declares; others keep their defaults.");
  s.place = f.place("file");
}

void build(const ScenarioLuaDevice& s, DeviceBuilder& b) {
  const auto fail = [&](const std::string& sentence) {
    throw ScenarioError(s.place + ": the device '" + b.name + "' cannot be used: " + sentence);
  };
  LuaDeviceParameters p;
  p.device = b.name;
  p.file = s.file.filename().string();
  std::ifstream in(s.file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) fail(s.file.string() + " cannot be read");
  p.text = text.str();
  if (p.text.size() > kMostText_bytes) fail(s.file.string() + " has more than 1 MB");
  for (const auto& [name, value] : s.parameters) p.parameters.push_back({name, value});
  p.step_s = b.cell.step_s;
  for (std::size_t i = 0; i < b.cell.description.robots.size(); ++i)
    p.robots.push_back({b.cell.description.robots[i].name, static_cast<int>(i),
                        static_cast<std::size_t>(b.cell.robots[i].arm.joint_count())});
  for (std::size_t i = 0; i < b.cell.components.size(); ++i)
    p.components.push_back({b.cell.components[i].name, static_cast<int>(i)});
  std::vector<SignalDescription> signals;
  try {
    const LuaDevice device(p);
    for (const LuaDevice::Signal& signal : device.declaration().signals)
      signals.push_back(signal.description);
  } catch (const std::runtime_error& error) {
    fail(error.what());
  }
  b.add<LuaDevice>(p, std::move(signals));
}

DeviceType lua_device_type() {
  return device_type<ScenarioLuaDevice>(DeviceType::Owner::cell, "lua_devices", "Devices written in Lua.",
                                        "A device with the signals, states and behaviour of its file "
                                        "(docs/lua_devices.md).",
                                        false, {}, "Those that its file declares by `input` and `output`.");
}

}  // namespace takt
