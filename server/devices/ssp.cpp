#include "server/devices/ssp.h"

#include <algorithm>

namespace takt {

void describe(Fields& f, ScenarioSsp& s) {
  f.field("file", s.file, f.file(),
          "The SSP. Its FMUs are code that runs on this machine: programs take them with `--allow-fmus DIR` "
          "alone.",
          kRequired);
  f.field("step_s", s.step_s, positive("s"),
          "Communication step of the FMUs, a whole multiple of `solver.step_s`; without it: one step of the "
          "cell.");
  f.field("timeout_s", s.timeout_s, positive("s"), "Longest wall time of one call; then the FMU has failed.",
          kNotInModel);
  f.field("memory_MiB", s.memory_MiB, WholeRange{64, 1 << 20}, "Largest address space of each process.",
          kNotInModel);
  s.place = f.place("file");
}

namespace {

constexpr std::size_t kLongestDevice = 64;

/// The signals of a system and how its connections become wires.
class SystemBuilder {
 public:
  SystemBuilder(const ScenarioSsp& stated, const FmuSystem& system, DeviceBuilder& b)
      : s_(stated), system_(system), b_(b), name_(b.name) {}

  void build() {
    add_ports();
    for (const FmuSystem::Element& element : system_.elements) add_element(element);
    b_.name = name_;
    for (const FmuSystem::Connection& connection : system_.connections) connect(connection);
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw ScenarioError(s_.place + ": the SSP " + s_.file.filename().string() + ": " + why);
  }

  std::string device_of(int element) const {
    return element < 0 ? name_ : name_ + "_" + system_.elements[static_cast<std::size_t>(element)].name;
  }

  void add_ports() {
    if (system_.ports.empty()) return;
    constexpr double kFarthest = 1e12;
    std::vector<SignalDescription> signals;
    std::vector<double> initial;
    for (const FmuSystem::Port& port : system_.ports) {
      const bool boolean = port.type == SignalType::boolean;
      signals.push_back(
          {port.name, port.unit, true, boolean ? 0.0 : -kFarthest, boolean ? 1.0 : kFarthest, port.type});
      initial.push_back(port.start);
    }
    if (signals.size() > static_cast<std::size_t>(kMaxSignals))
      fail("found " + std::to_string(signals.size()) +
           " connectors of the system; allowed: " + std::to_string(kMaxSignals));
    b_.add_signal_table(initial, std::move(signals), initial);
  }

  void add_element(const FmuSystem::Element& element) {
    ScenarioFmu fmu;
    FmuRequest& r = fmu.request;
    r.file = element.file;
    r.inputs = element.inputs, r.outputs = element.outputs;
    r.values = element.values;
    r.timeout_s = s_.timeout_s, r.memory_MiB = s_.memory_MiB;
    r.place = [place = s_.place, name = element.name](const std::string&) {
      return place + ": component " + name;
    };
    fmu.step_s = s_.step_s;
    b_.name = name_ + "_" + element.name;
    if (b_.name.size() > kLongestDevice)
      fail("found a component with the device " + b_.name + "; allowed: names of at most " +
           std::to_string(kLongestDevice) + " letters, that of the system included");
    if (b_.cell.description.find_device(b_.name) >= 0)
      fail("found a component with the device " + b_.name +
           ", which another device is; allowed: other names");
    takt::build(fmu, b_);
    if (!element.note.empty()) b_.cell.import_notes.push_back({b_.name, b_.name + ": " + element.note, {}});
  }

  const SignalDescription& signal_of(const FmuSystem::End& end, const std::string& place) const {
    const int device = b_.cell.description.find_device(device_of(end.element));
    for (const SignalDescription& signal :
         b_.cell.description.devices.at(static_cast<std::size_t>(device)).signals)
      if (signal.name == end.signal) return signal;
    fail(place + ": found '" + end.signal + "', which is no signal of " + device_of(end.element));
  }

  /// The unit of the connector, or else of the variable.
  std::string unit_of(const FmuSystem::End& end, const std::string& place) const {
    if (end.element >= 0) {
      const auto& units = system_.elements[static_cast<std::size_t>(end.element)].units;
      if (const auto found = units.find(end.signal); found != units.end()) return found->second;
    }
    return signal_of(end, place).unit;
  }

  void connect(const FmuSystem::Connection& c) {
    double factor = 1.0, offset = 0.0;
    std::string from = unit_of(c.from, c.place);
    for (const FmuSystem::Connection::Step& step : c.steps) {
      const std::string to = &step == &c.steps.back() ? unit_of(c.to, c.place) : step.unit;
      double scale = step.factor, shift = step.offset;
      if (step.converts_units && !from.empty() && !to.empty() && from != to) {
        const auto source = system_.units.find(from), target = system_.units.find(to);
        if (source == system_.units.end() || target == system_.units.end() ||
            source->second.exponents != target->second.exponents)
          fail(c.place + ": found the units '" + from + "' and '" + to +
               "'; allowed: the same unit, units of the same quantity that Units defines, or "
               "suppressUnitConversion=\"true\"");
        // In SI: factor * value + offset.
        const FmuUnit &a = source->second, &z = target->second;
        shift += step.factor * (a.offset - z.offset) / z.factor;
        scale = step.factor * a.factor / z.factor;
      }
      factor *= scale;
      offset = scale * offset + shift;
      from = to;
    }
    const std::string signal = device_of(c.from.element) + "." + c.from.signal;
    signal_of(c.from, c.place), signal_of(c.to, c.place);
    std::string text = signal;
    if (offset != 0.0)
      text = exact_number(factor) + " * " + signal + " + " + exact_number(offset);
    else if (factor != 1.0)
      text = exact_number(factor) + " * " + signal;
    b_.wires.push_back({device_of(c.to.element) + "." + c.to.signal, text, s_.place + ": " + c.place});
  }

  const ScenarioSsp& s_;
  const FmuSystem& system_;
  DeviceBuilder& b_;
  const std::string name_;
};

}  // namespace

void build(const ScenarioSsp& s, DeviceBuilder& b) {
  if (b.fmus == nullptr)
    throw ScenarioError(s.place + ": found '" + s.file.filename().string() +
                        "'; allowed: no SSP, as its FMUs are code that runs on this machine. The option "
                        "--allow-fmus DIR permits those in one directory");
  const FmuSystem system = b.fmus->open_system(s.file, s.place);
  SystemBuilder(s, system, b).build();
}

DeviceType ssp_type() {
  return device_type<ScenarioSsp>(DeviceType::Owner::cell, "ssp", "Systems of FMUs (SSP 1.0).",
                                  "An SSP as devices and wires: docs/fmi.md.", false, {},
                                  "Input connectors of the system; its components are devices like `fmus`.");
}

}  // namespace takt
