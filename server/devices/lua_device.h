#pragma once
// A device written in Lua, in a file that the scenario names: signals, parameters, discrete state and differential states,
// without recompiling (docs/lua_devices.md).
//
// The text runs once, when the cell is loaded; there it declares what the device has. Afterwards two functions are called:
//   step(self, dt)                        between accepted steps, once a step; may set signals, state and x
//   derivatives(t, x, inputs, state)      by the solver, any number of times; pure
// All that a device remembers is declared, and lives here and not in Lua: signals, state, x. A function that changes
// another variable is refused, so that snapshots, replay and reset need no Lua. Memory and instructions are limited
// (LuaSandbox). Calls of Lua allocate, so that cells with Lua devices allocate in the step path.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "server/devices/device_type.h"
#include "server/simulation/model/hashed_state.h"

namespace takt {

/// The keys of a Lua device in a scenario.
struct ScenarioLuaDevice {
  std::filesystem::path file;
  std::map<std::string, double> parameters;
  std::string place;  ///< of `file`
};
DeviceType lua_device_type();

inline constexpr std::size_t kMostLuaState = 64;          ///< discrete values of a device
inline constexpr std::size_t kMostLuaStates = 64;         ///< differential states
inline constexpr std::size_t kLongestLuaText_bytes = 64;  ///< of a text in the discrete state

/// A value of the discrete state.
using LuaStateValue = std::variant<double, bool, std::string>;

struct LuaDeviceParameters {
  struct Parameter {
    std::string name;
    double value = 0.0;
  };
  struct Robot {
    std::string name;
    int index = -1;
    std::size_t joints = 0;
  };
  struct Component {
    std::string name;
    int index = -1;
  };
  std::string device;                 ///< name, for errors
  std::string file;                   ///< as the scenario has it, for errors
  std::string text;                   ///< of the file; enters the model hash
  std::vector<Parameter> parameters;  ///< stated in the scenario
  double step_s = 0.0;
  std::vector<Robot> robots;          ///< whose joints it may read
  std::vector<Component> components;  ///< whose positions it may read
};

/// What a text of a device may use, as sections of docs/lua.md.
std::string lua_device_reference();

class LuaDevice final : public DeviceModel, public HashedState {
 public:
  /// A signal of the device and how it is filled.
  struct Signal {
    SignalDescription description;
    double initial = 0.0;
    int state = -1;  ///< the differential state that it reports
  };
  /// What the text declares.
  struct Declaration {
    std::vector<Signal> signals;
    std::vector<std::pair<std::string, LuaStateValue>> state;  ///< in the order of names
    struct Differential {
      std::string name;
      double initial = 0.0, scale = 1.0;
    };
    std::vector<Differential> differential;
    bool has_step = false, has_derivatives = false;
  };

  friend std::string lua_device_reference();

  /// Runs the text. Throws std::runtime_error with file and line.
  explicit LuaDevice(const LuaDeviceParameters& parameters);
  ~LuaDevice() override;

  const Declaration& declaration() const { return declaration_; }

  int state_count() const override { return static_cast<int>(declaration_.differential.size()); }
  void initial_state(double* x) const override;
  void write_motion(double, const double*, CellMotion&) const override {}
  void derivatives(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                   double* xdot) const override;
  void state_scales(double* scales) const override;
  bool decide(double t, double* x, const CellMotion& motion) override;
  void reset() override;
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  std::uint64_t discrete_hash() const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  class Interpreter;

  std::unique_ptr<Interpreter> make_interpreter();

  LuaDeviceParameters p_;
  Declaration declaration_;
  std::vector<double> signals_;
  std::vector<LuaStateValue> state_;
  bool started_ = false;  ///< the call of decide() after a reset belongs to no step
  std::unique_ptr<Interpreter> lua_;
};

}  // namespace takt
