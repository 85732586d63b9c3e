#include "server/devices/fmu.h"

#include <algorithm>
#include <cmath>

#include "plant_models/state_bytes.h"
#include "server/simulation/model/state_hash.h"

namespace takt {
namespace {

constexpr std::size_t kLargestState = 256U << 20U;
constexpr std::size_t kLongestSentence = 4096;
constexpr KindSignal kFmuSignals[] = {
    reported_flag("failed", "the FMU has failed; its outputs keep their last values until a reset")};

/// NAME: value, where values are numbers, true, false or texts.
struct VariableValues {
  static std::string allowed() {
    return "a mapping of variables of the FMU to numbers, true, false or texts";
  }
  static void read(const FieldValue& value, std::map<std::string, std::string>& values) {
    if (value.node.IsNull()) return;
    if (!value.node.IsMap()) value.fail(describe_node(value.node), allowed());
    for (const auto& entry : value.node) {
      if (!entry.first.IsScalar() || !entry.second.IsScalar())
        value.part(entry.second).fail(describe_node(entry.second), allowed());
      values[entry.first.Scalar()] = entry.second.Scalar();
    }
  }
  static YAML::Node write(const std::map<std::string, std::string>& values) {
    YAML::Node node(YAML::NodeType::Map);
    for (const auto& [name, value] : values) node[name] = value;
    return node;
  }
  static KeyInfo info() {
    KeyInfo result;
    result.items.push_back({.kind = KeyInfo::Kind::text, .key = "*", .doc = "Variable of the FMU."});
    result.items.back().other_forms = {{.kind = KeyInfo::Kind::number}, {.kind = KeyInfo::Kind::flag}};
    return result;
  }
};

/// Variables, or SIGNAL: VARIABLE.
struct Wires {
  static std::string allowed() {
    return "a list of variables of the FMU, or a mapping of signals to variables, e.g. {torque: motor.tau}";
  }
  static void read(const FieldValue& value, std::vector<FmuWire>& wires) {
    if (value.node.IsNull()) return;
    if (!value.node.IsMap() && !value.node.IsSequence()) value.fail(describe_node(value.node), allowed());
    for (const auto& entry : value.node) {
      const YAML::Node& variable = value.node.IsMap() ? entry.second : entry;
      if (!variable.IsScalar() || variable.Scalar().empty())
        value.part(variable).fail(describe_node(variable), allowed());
      wires.emplace_back(value.node.IsMap() ? entry.first.Scalar() : std::string(), variable.Scalar());
    }
  }
  static YAML::Node write(const std::vector<FmuWire>& wires) {
    const bool named =
        std::any_of(wires.begin(), wires.end(), [](const FmuWire& w) { return !w.first.empty(); });
    YAML::Node node(named ? YAML::NodeType::Map : YAML::NodeType::Sequence);
    for (const auto& [signal, variable] : wires) {
      if (named)
        node[signal] = variable;
      else
        node.push_back(variable);
    }
    return node;
  }
  static KeyInfo info() {
    KeyInfo list{.kind = KeyInfo::Kind::list};
    list.items.push_back({.kind = KeyInfo::Kind::text});
    KeyInfo map;
    map.items.push_back({.kind = KeyInfo::Kind::text, .key = "*", .doc = "Signal of the device."});
    list.other_forms.push_back(map);
    return list;
  }
};

}  // namespace

/// The way to the file and the functions change no result.
static void digest(ModelDigest& digest, const FmuOffer& offer) {
  digest << offer.digest << offer.input_start << offer.output_start;
}

void describe(Fields& f, ScenarioFmu& s) {
  FmuRequest& r = s.request;
  f.field("file", r.file, f.file(),
          "The FMU. It is code that runs on this machine: programs take FMUs with `--allow-fmus DIR` alone.",
          kRequired);
  f.field("step_s", s.step_s, positive("s"),
          "Communication step of the FMU, a whole multiple of `solver.step_s`; without it: one step of the "
          "cell.");
  f.field("parameters", r.parameters, VariableValues{}, "Parameters of the FMU.");
  f.field("start", r.start, VariableValues{}, "Start values of its inputs and states.");
  f.field("inputs", r.inputs, Wires{}, "Inputs that are commanded signals of the device; without it: all.");
  f.field("outputs", r.outputs, Wires{},
          "Outputs and other variables that are reported signals of the device; without it: all outputs.");
  f.field("timeout_s", r.timeout_s, positive("s"), "Longest wall time of one call; then the FMU has failed.",
          kNotInModel);
  f.field("memory_MiB", r.memory_MiB, WholeRange{64, 1 << 20}, "Largest address space of its process.",
          kNotInModel);
  if (f.reading()) {
    std::map<std::string, std::string> places;
    for (const char* key : {"", "file", "step_s", "parameters", "start", "inputs", "outputs"})
      places[key] = f.place(key);
    r.place = [places](const std::string& key) { return places.at(key); };
  }
}

void build(const ScenarioFmu& s, DeviceBuilder& b) {
  FmuParameters p;
  FmuRequest request = s.request;
  const auto place = [&](const char* key) { return request.place ? request.place(key) : b.name + "." + key; };
  if (!request.place) request.place = [&b](const std::string& key) { return b.name + "." + key; };
  if (b.fmus == nullptr)
    throw ScenarioError(place("file") + ": found '" + request.file.filename().string() +
                        "'; allowed: no FMU, as an FMU is code that runs on this machine. The option "
                        "--allow-fmus DIR permits those in one directory");
  p.cell_step_s = b.cell.step_s;
  request.device = b.name;
  request.step_s = s.step_s.value_or(b.cell.step_s);
  const double steps = request.step_s / b.cell.step_s;
  p.cell_steps = static_cast<int>(std::lround(std::min(steps, 1e9)));
  if (p.cell_steps < 1 || std::abs(steps - p.cell_steps) > 1e-9 * steps)
    throw ScenarioError(place("step_s") + ": found " + rounded_number(request.step_s) +
                        "; allowed: a whole multiple of solver.step_s, " + rounded_number(b.cell.step_s) +
                        " s");
  p.offer = b.fmus->open(request);
  std::vector<SignalDescription> signals = p.offer.inputs;
  signals.insert(signals.end(), p.offer.outputs.begin(), p.offer.outputs.end());
  for (const SignalDescription& own : described(kFmuSignals)) signals.push_back(own);
  if (signals.size() > static_cast<std::size_t>(kMaxSignals))
    throw ScenarioError(
        place("file") + ": found " + std::to_string(p.offer.inputs.size()) + " inputs and " +
        std::to_string(p.offer.outputs.size()) + " outputs; allowed: " + std::to_string(kMaxSignals - 1) +
        " signals of one device, beside 'failed'. The keys inputs and outputs choose among them");
  for (std::size_t i = 0; i < signals.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (signals[i].name == signals[k].name)
        throw ScenarioError(place("") + ": found two signals with the name '" + signals[i].name +
                            "'; allowed: unique names. The keys inputs and outputs give signals other names: "
                            "{SIGNAL: VARIABLE}");
  for (const std::string& note : p.offer.notes) b.cell.import_notes.push_back({b.name, note, {}});
  b.add<FmuDevice>(p, std::move(signals));
}

DeviceType fmu_type() {
  return device_type<ScenarioFmu>(
      DeviceType::Owner::cell, "fmus", "FMUs (co-simulation, FMI 2.0 and 3.0).",
      "An FMU as a device: docs/fmi.md.", false, kFmuSignals,
      "In front of it: inputs and outputs of the FMU, or those that `inputs` and `outputs` name.");
}

FmuDevice::FmuDevice(const FmuParameters& parameters)
    : p_(parameters),
      link_(p_.offer.make()),
      inputs_(p_.offer.input_start),
      now_(p_.offer.output_start),
      next_(p_.offer.output_start) {}

void FmuDevice::fail(std::string why) {
  failure_ = std::move(why);
  failure_.resize(std::min(failure_.size(), kLongestSentence));
  notice_ = failure_;
}

void FmuDevice::reset() {
  inputs_ = p_.offer.input_start;
  now_ = next_ = p_.offer.output_start;
  next_from_s_ = 0.0;
  steps_ = 0;
  starting_ = true;
  failure_.clear();
  notice_.clear();
  if (std::string why = link_->restart(next_); !why.empty()) fail(std::move(why));
  now_ = next_;
}

bool FmuDevice::decide(double t, double*, const CellMotion&) {
  if (std::exchange(starting_, false)) return false;
  const auto multiple = static_cast<std::uint64_t>(p_.cell_steps);
  if (steps_++ % multiple != 0 || !failure_.empty()) return false;
  now_ = next_;
  const double h = p_.cell_step_s * p_.cell_steps;
  next_from_s_ = t + h - 0.5 * p_.cell_step_s;
  if (std::string why = link_->step(t, h, inputs_, next_); !why.empty()) {
    next_ = now_;
    fail(std::move(why));
  }
  return false;
}

void FmuDevice::set_signal(double, int signal, double value) {
  const auto i = static_cast<std::size_t>(signal);
  if (i < inputs_.size()) inputs_[i] = value;
}

void FmuDevice::read_signals(double t, const double*, const CellMotion&, std::span<double> signals) const {
  std::copy(inputs_.begin(), inputs_.end(), signals.begin());
  const std::vector<double>& outputs = t > next_from_s_ ? next_ : now_;
  std::copy(outputs.begin(), outputs.end(), signals.begin() + static_cast<std::ptrdiff_t>(inputs()));
  signals[inputs() + outputs.size()] = failure_.empty() ? 0.0 : 1.0;
}

std::uint64_t FmuDevice::discrete_hash() const {
  StateHash hash;
  hash.add(std::span<const double>(next_));
  return hash.value();
}

std::string FmuDevice::take_message() {
  if (notice_.empty()) notice_ = link_->take_message();
  return std::exchange(notice_, {});
}

void FmuDevice::save(StateWriter& out) const {
  out.put(steps_), out.put(starting_), out.put(next_from_s_);
  out.put(std::span<const double>(inputs_)), out.put(std::span<const double>(now_));
  out.put(std::span<const double>(next_));
  out.put(std::string_view(failure_));
  if (!failure_.empty()) return;
  std::vector<std::byte> state;
  if (const std::string why = link_->save(state); !why.empty()) throw StateError(why);
  out.put(std::string_view(reinterpret_cast<const char*>(state.data()), state.size()));
}

void FmuDevice::load(StateReader& in) {
  steps_ = in.get<std::uint64_t>();
  starting_ = in.flag("'an FMU is at its start'");
  next_from_s_ = in.number("a time");
  in.numbers(inputs_, "an input of an FMU");
  in.numbers(now_, "an output of an FMU");
  in.numbers(next_, "an output of an FMU");
  failure_ = in.text(kLongestSentence, "letters of a failure");
  notice_.clear();
  if (!failure_.empty()) return;
  const std::string state = in.text(kLargestState, "bytes of an FMU's state");
  const auto* bytes = reinterpret_cast<const std::byte*>(state.data());
  if (const std::string why = link_->load({bytes, state.size()}); !why.empty()) in.fail(why);
}

}  // namespace takt
