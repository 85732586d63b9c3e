#pragma once
// modelDescription.xml of an FMU (FMI 2.0 and 3.0), as far as a master of co-simulation needs it.
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "server/devices/fmu_link.h"

namespace takt {

/// What is wrong with an FMU, or why takt cannot use it: a sentence.
class FmuError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Types of variables. FMI 2.0 has float64, int32, boolean, text, enumeration.
enum class FmuType : std::uint8_t {
  float64,
  float32,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  boolean,
  enumeration,
  text,
  binary,
  clock
};
/// As FMI 3.0 writes it.
std::string_view name_of(FmuType type);
/// True if values of this type are values of signals.
inline bool is_signal(FmuType type) {
  return type < FmuType::text;
}

struct FmuVariable {
  std::string name;
  std::uint32_t reference = 0;
  FmuType type = FmuType::float64;
  std::string causality = "local", variability, initial, unit;
  std::optional<double> lower, upper;
  std::vector<std::string> start{};  ///< by element
  std::size_t elements = 1;
  bool is_array = false;
  /// Of FMI 3.0: the clocks that it belongs to; without one it is there at each step.
  std::vector<std::uint32_t> clocks{};
  bool is_triggered_clock = false;  ///< takt lets it tick, or reads its ticks
  std::string unusable{};           ///< why no signal or value can be an element of this array; else empty
  /// Of an enumeration, if its description names them: values by name.
  std::shared_ptr<const std::map<std::string, std::string>> items{};
};

/// True if its values are those of a signal.
inline bool is_signal(const FmuVariable& variable) {
  return is_signal(variable.type) || variable.is_triggered_clock;
}

/// An input clock of FMI 3.0 that ticks at shift_s + k * interval_s.
struct FmuClock {
  std::string name;
  std::uint32_t reference = 0;
  double interval_s = 0.0, shift_s = 0.0;
};

/// An FMU for co-simulation.
struct FmuDescription {
  int version = 2;  ///< 2 or 3
  std::string model_name, token, generation_tool, license, identifier;
  bool needs_tool = false;  ///< that made it, to run
  bool has_event_mode = false;
  bool uses_event_mode = false;  ///< it has clocks too, which need it
  bool variable_step = false, can_copy_state = false, can_serialise_state = false;
  double fixed_step_s = 0.0;    ///< 0: not stated
  double default_step_s = 0.0;  ///< of the default experiment; 0: not stated
  double tolerance = 0.0;       ///< of the default experiment, relative; 0: not stated
  std::vector<FmuVariable> variables;
  std::vector<FmuClock> clocks;            ///< with constant intervals
  std::vector<std::string> silent_clocks;  ///< inputs whose ticks the FMU alone would plan: they do not tick
  std::unordered_map<std::string, std::size_t> by_name;
  std::map<std::string, FmuUnit> units;  ///< that it defines by those of SI

  /// A variable, or an element NAME[i] of an array, from 1 on. Throws FmuError.
  struct Element {
    const FmuVariable* variable = nullptr;
    std::size_t element = 0;
  };
  Element find(const std::string& name) const;
};

/// Letters, digits and underscores of a variable's name: motor.tau[1] is motor_tau_1.
std::string signal_name(const std::string& variable);

/// `structural`: values of structural parameters by name, which set sizes of arrays; other names are ignored. Throws FmuError: no
/// XML, no FMI 2.0 or 3.0, no co-simulation, or beyond the limits.
FmuDescription read_model_description(std::string_view xml,
                                      const std::map<std::string, std::string>& structural = {});

}  // namespace takt
