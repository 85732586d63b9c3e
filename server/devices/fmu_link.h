#pragma once
// FMUs as devices see them: what a scenario asks for, what an FMU offers, and the running instance. The core knows no
// archive, process or clock; server/fmu opens FMUs, and the program passes it on (ImportOptions::fmus).
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/simulation/model/cell_description.h"

namespace takt {

/// A running co-simulation FMU. Every function returns an empty text, or a sentence with the reason why it failed; the
/// outputs then keep their values. After a failure only restart() is of use. None of them throws.
class FmuLink {
 public:
  virtual ~FmuLink() = default;
  /// Initialises the FMU at time 0, again if it has run; also after a failure.
  virtual std::string restart(std::span<double> outputs) = 0;
  /// Sets the inputs, which are held, and advances from t to t + h (s).
  virtual std::string step(double t, double h, std::span<const double> inputs, std::span<double> outputs) = 0;
  /// What deserves a word though it harms nothing, once; else empty.
  virtual std::string take_message() = 0;
  /// The FMU's own state as bytes, and back.
  virtual std::string save(std::vector<std::byte>& state) = 0;
  virtual std::string load(std::span<const std::byte> state) = 0;
};

/// A signal of the device and the variable of the FMU that it stands for.
using FmuWire = std::pair<std::string, std::string>;

/// A unit of FMI and SSP: value in SI = factor * value + offset.
struct FmuUnit {
  std::array<int, 8> exponents{};  ///< of kFmuBaseUnits
  double factor = 1.0, offset = 0.0;
};
inline constexpr std::array<const char*, 8> kFmuBaseUnits{"kg", "m", "s", "A", "K", "mol", "cd", "rad"};

/// An FMU as a scenario asks for it.
struct FmuRequest {
  std::string device;
  std::filesystem::path file;
  double step_s = 0.0;                                   ///< of the FMU
  std::map<std::string, std::string> parameters, start;  ///< by variable: value as text
  std::optional<std::vector<FmuWire>> inputs, outputs;   ///< none: all
  /// Parameters and start values together, of which those that the FMU does not have are left out: of an SSP.
  struct Value {
    std::string text, unit;
    std::optional<FmuUnit> defined{};  ///< `unit`, where the parameter set or the system defines it
  };
  std::map<std::string, Value> values{};
  double timeout_s = 5.0;                                      ///< wall time of one call
  int memory_MiB = 1024;                                       ///< address space of its process
  std::function<std::string(const std::string& key)> place{};  ///< of a key, for errors
};

/// What an FMU offers a device: its signals and how to start it.
struct FmuOffer {
  std::vector<SignalDescription> inputs, outputs;
  std::vector<double> input_start, output_start;  ///< at time 0
  std::function<std::unique_ptr<FmuLink>()> make{};
  std::uint64_t digest = 0;          ///< of the file and of all that the request chose
  std::vector<std::string> notes{};  ///< for the user
};

/// A system of FMUs, as a file (SSP) states it; systems in it are dissolved: their elements are its own, and connections
/// through their connectors lead from element to element.
struct FmuSystem {
  struct Element {
    std::string name;  ///< letters, digits and underscores
    std::filesystem::path file;
    std::vector<FmuWire> inputs, outputs;
    std::map<std::string, FmuRequest::Value> values;
    std::map<std::string, std::string> units;  ///< by signal, where the file states them
    std::string note;                          ///< for the user; or empty
  };
  /// An input or output of the system itself.
  struct Port {
    std::string name, unit;
    SignalType type = SignalType::real;
    bool is_input = true;
    double start = 0.0;
  };
  /// The signal of an element, by its index, or a port of the system: -1.
  struct End {
    int element = -1;
    std::string signal;
  };
  struct Connection {
    /// From connector to connector.
    struct Step {
      bool converts_units = true;
      double factor = 1.0, offset = 0.0;  ///< after the conversion
      std::string unit;                   ///< of the connector that it leads to; of the last step: see `to`
    };
    End from, to;
    std::vector<Step> steps;  ///< one, and one for each connector of an inner system on the way
    std::string place;
  };
  std::vector<Element> elements;
  std::vector<Port> ports;
  std::vector<Connection> connections;
  std::map<std::string, FmuUnit> units;
  std::shared_ptr<const void> files{};  ///< keeps those of the elements
};

/// Opens FMUs and systems of FMUs.
class FmuOpener {
 public:
  virtual ~FmuOpener() = default;
  /// Throws ScenarioError with the place of the key and the reason.
  virtual FmuOffer open(const FmuRequest& request) = 0;
  /// The FMUs of the system can be opened while it lives. Throws ScenarioError.
  virtual FmuSystem open_system(const std::filesystem::path& file, const std::string& place) = 0;
};

}  // namespace takt
