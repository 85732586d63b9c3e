#include "server/fmu/fmu_library.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "idl/common/bounded_file.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fields/field_value.h"
#include "server/fields/scenario_error.h"
#include "server/fmu/fmu_archive.h"
#include "server/fmu/fmu_process.h"
#include "server/fmu/model_description.h"
#include "server/fmu/ssp_file.h"
#include "server/fmu/units.h"
#include "server/simulation/model/model_digest.h"

namespace takt {
namespace {

/// Limits of signals that state none.
constexpr double kFarthest = 1e12;

struct Limits {
  double lower, upper;
};
Limits limits_of(const FmuVariable& v) {
  const double most53 = 9007199254740992.0;  // whole numbers that a double has
  Limits all{-kFarthest, kFarthest};
  switch (v.type) {
    case FmuType::boolean:
    case FmuType::clock:
      return {0.0, 1.0};
    case FmuType::int8:
      all = {-128.0, 127.0};
      break;
    case FmuType::uint8:
      all = {0.0, 255.0};
      break;
    case FmuType::int16:
      all = {-32768.0, 32767.0};
      break;
    case FmuType::uint16:
      all = {0.0, 65535.0};
      break;
    case FmuType::enumeration:
    case FmuType::int32:
      all = {-2147483648.0, 2147483647.0};
      break;
    case FmuType::uint32:
      all = {0.0, 4294967295.0};
      break;
    case FmuType::uint64:
      all = {0.0, most53};
      break;
    case FmuType::int64:
      all = {-most53, most53};
      break;
    case FmuType::float32:
      all = {-3e38, 3e38};
      break;
    default:
      break;
  }
  const Limits stated{std::max(all.lower, v.lower.value_or(all.lower)),
                      std::min(all.upper, v.upper.value_or(all.upper))};
  return stated.lower <= stated.upper ? stated : all;
}

SignalType signal_type(FmuType type) {
  if (type == FmuType::boolean || type == FmuType::clock) return SignalType::boolean;
  return type == FmuType::float64 || type == FmuType::float32 ? SignalType::real : SignalType::integer;
}

bool is_signal_name(const std::string& name) {
  return signal_name(name) == name ||
         (!name.empty() && name.size() <= 64 &&
          name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") ==
              std::string::npos &&
          (name.front() < '0' || name.front() > '9'));
}

/// The value of a start or parameter as the host takes it, or a sentence about what is allowed.
std::string check_value(const FmuVariable& v, std::string& value) {
  const FmuType type = v.type;
  if (type == FmuType::text) return {};
  if (v.items) {
    std::string names;
    for (const auto& [name, number] : *v.items) {
      if (value == name) value = number;
      if (names.size() < 200) names += ", " + name;
    }
    if (!finite_number(value)) return "a whole number or one of its names" + names;
  }
  if (type == FmuType::boolean) {
    if (value == "1") value = "true";
    if (value == "0") value = "false";
    return value == "true" || value == "false" ? "" : "true or false";
  }
  const auto number = finite_number(value);
  if (!number) return "a number";
  const bool whole = signal_type(type) == SignalType::integer;
  if (whole && *number != std::floor(*number)) return "a whole number";
  FmuVariable of_type;
  of_type.type = type;
  const auto [lower, upper] = limits_of(of_type);
  if (whole && (*number < lower || *number > upper))
    return "a whole number from " + number_text(lower, 16) + " to " + number_text(upper, 16);
  return {};
}

/// The request and the description together.
class Wiring {
 public:
  Wiring(const FmuRequest& request, const FmuDescription& fmu) : r_(request), fmu_(fmu) {}

  void connect(FmuOffer& offer, fmu_wire::Start& start) {
    check_step(offer);
    set(r_.parameters, "parameters", start);
    set(r_.start, "start", start);
    set_values(offer, start);
    wire_inputs(offer, start);
    wire_outputs(offer, start);
  }

 private:
  [[noreturn]] void fail(const char* key, const std::string& why) const {
    throw ScenarioError(r_.place(key) + ": the FMU " + r_.file.filename().string() + ": " + why);
  }

  void check_step(FmuOffer& offer) const {
    const auto is_multiple = [this](double of_s) {
      const double steps = r_.step_s / of_s;
      return steps > 0.5 && std::abs(steps - std::round(steps)) <= 1e-6 * steps;
    };
    const double fixed = fmu_.fixed_step_s, usual = fmu_.default_step_s;
    if (fixed > 0.0 && !is_multiple(fixed))
      fail("step_s", "its internal step is " + number_text(fixed, 9) + " s; found a step of " +
                         number_text(r_.step_s, 9) + " s; allowed: a whole multiple, e.g. step_s: " +
                         number_text(fixed, 9) + " with a solver.step_s that divides it");
    // Its steps have to be of one size, not of this one.
    if (fixed == 0.0 && !fmu_.variable_step && usual > 0.0 && std::abs(r_.step_s - usual) > 1e-6 * usual)
      offer.notes.push_back(r_.device + ": the FMU takes steps of " + number_text(r_.step_s, 9) +
                            " s; its description prefers step_s: " + number_text(usual, 9) +
                            " and states that it cannot vary its step.");
    if (fmu_.uses_event_mode) check_clocks(offer);
    if (!fmu_.can_serialise_state)
      offer.notes.push_back(r_.device + ": the FMU cannot save its state; this cell has no snapshots.");
  }

  void check_clocks(FmuOffer& offer) const {
    for (const std::string& name : fmu_.silent_clocks)
      offer.notes.push_back(
          r_.device + ": the clock '" + name +
          "' of the FMU does not tick: takt knows constant intervals and triggered clocks.");
    for (const FmuClock& clock : fmu_.clocks) {
      const double interval = clock.interval_s, steps = interval / r_.step_s;
      if (steps < 1.0 - 1e-6)
        fail("step_s", "its clock '" + clock.name + "' ticks every " + number_text(interval, 9) +
                           " s; found a step of " + number_text(r_.step_s, 9) + " s; allowed: up to this");
      if (std::abs(std::round(steps) - steps) > 1e-6 * steps)
        offer.notes.push_back(r_.device + ": the clock '" + clock.name + "' of the FMU ticks every " +
                              number_text(interval, 9) + " s, at the end of the step of " +
                              number_text(r_.step_s, 9) + " s that this falls in.");
    }
  }

  FmuDescription::Element find(const char* key, const std::string& name) const {
    try {
      return fmu_.find(name);
    } catch (const FmuError& error) {
      fail(key, error.what());
    }
  }

  /// Values of a parameter set, which may name more than the FMU has.
  void set_values(FmuOffer& offer, fmu_wire::Start& start) const {
    std::map<std::string, std::string> parameters, others;
    for (const auto& [name, value] : r_.values) {
      FmuDescription::Element found;
      try {
        found = fmu_.find(name);
      } catch (const FmuError&) {
        offer.notes.push_back(r_.device + ": the FMU has no variable '" + name +
                              "' for the value of the parameter set.");
        continue;
      }
      (found.variable->causality == "parameter" || found.variable->causality == "structuralParameter"
           ? parameters
           : others)[name] = in_unit_of(*found.variable, name, value);
    }
    set(parameters, "parameters", start);
    set(others, "start", start);
  }

  /// Where one of the two has no unit nothing is converted.
  std::string in_unit_of(const FmuVariable& variable, const std::string& name,
                         const FmuRequest::Value& value) const {
    if (value.unit.empty() || variable.unit.empty() || value.unit == variable.unit) return value.text;
    const auto number = finite_number(value.text);
    const auto converted = number ? in_unit(*number, value, variable.unit, fmu_.units) : std::nullopt;
    if (!converted)
      fail("file", "the parameter set gives '" + name + "' in the unit '" + value.unit +
                       "'; allowed: that of the FMU, '" + variable.unit +
                       "', or a unit of the same quantity that Units of the parameter set defines");
    return exact_text(*converted);
  }

  void set(const std::map<std::string, std::string>& values, const char* key, fmu_wire::Start& start) const {
    const bool parameters = std::string_view(key) == "parameters";
    std::map<const FmuVariable*, fmu_wire::Setting> settings;
    for (const auto& [name, stated] : values) {
      const auto [v, element] = find(key, name);
      const bool structural = v->causality == "structuralParameter";
      const bool is_parameter = structural || v->causality == "parameter";
      if (parameters && !is_parameter)
        fail(key, "'" + name + "' is no parameter but has the causality " + v->causality +
                      "; start values of inputs and states stand under 'start'");
      if (!parameters && is_parameter)
        fail(key, "'" + name + "' is a parameter; it stands under 'parameters'");
      if (!parameters && v->causality != "input" && v->initial != "exact" && v->initial != "approx")
        fail(key, "'" + name + "' has no start value that can be set: the FMU calculates it (causality " +
                      v->causality + ")");
      if (v->variability == "constant") fail(key, "'" + name + "' is a constant");
      if (v->type > FmuType::text)
        fail(key,
             "'" + name + "' has the type " + std::string(name_of(v->type)) + ", which takt does not set");
      std::string value = stated;
      if (const std::string allowed = check_value(*v, value); !allowed.empty())
        fail(key, "'" + name + "' is " + std::string(name_of(v->type)) + ": found '" + stated +
                      "'; allowed: " + allowed);
      const auto number = finite_number(value);
      if (is_signal(v->type) && number &&
          ((v->lower && *number < *v->lower) || (v->upper && *number > *v->upper)))
        fail(key,
             "'" + name + "': found " + value +
                 "; allowed: " + (v->lower ? "from " + number_text(*v->lower, 9) : "") +
                 (v->upper ? std::string(v->lower ? " " : "") + "up to " + number_text(*v->upper, 9) : ""));
      auto& setting =
          settings
              .try_emplace(v, fmu_wire::Setting{v->name, v->type, v->reference, structural, all_starts(*v)})
              .first->second;
      setting.values[element] = value;
    }
    for (auto& [v, setting] : settings) start.settings.push_back(std::move(setting));
    std::sort(start.settings.begin(), start.settings.end(),
              [](const auto& a, const auto& b) { return a.reference < b.reference; });
  }

  /// Start values of all elements; a single one stands for all.
  std::vector<std::string> all_starts(const FmuVariable& v) const {
    std::vector<std::string> result = v.start;
    const char* none = v.type == FmuType::boolean ? "false" : v.type == FmuType::text ? "" : "0";
    const std::string usual = result.empty() ? none : result.front();
    result.resize(v.elements, usual);
    return result;
  }

  std::vector<FmuWire> all(const char* causality, FmuOffer& offer) const {
    std::vector<FmuWire> wires;
    std::string skipped;
    for (const FmuVariable& v : fmu_.variables) {
      if (v.causality != causality) continue;
      if (!is_signal(v) || !v.unusable.empty()) {
        skipped += (skipped.empty() ? "" : ", ") + v.name;
        continue;
      }
      for (std::size_t i = 0; i < v.elements; ++i) {
        wires.emplace_back("", v.is_array ? v.name + "[" + std::to_string(i + 1) + "]" : v.name);
        if (wires.size() > 1000) return wires;
      }
    }
    if (!skipped.empty())
      offer.notes.push_back(
          r_.device + ": no signals are " + skipped.substr(0, 200) +
          " of the FMU, as they are no numbers, or arrays without a size or with too many elements.");
    return wires;
  }

  std::string name_for(const FmuWire& wire, const char* key) const {
    const std::string name = wire.first.empty() ? signal_name(wire.second) : wire.first;
    if (!is_signal_name(name))
      fail(key, "the signal '" + name +
                    "' cannot have this name; allowed are letters, digits and underscores, no digit first, "
                    "at most 64");
    return name;
  }

  fmu_wire::Place place_of(const FmuVariable& v, std::size_t element) const {
    return {v.is_array ? v.name + "[" + std::to_string(element + 1) + "]" : v.name,
            v.type,
            v.reference,
            v.elements,
            element,
            {},
            fmu_.uses_event_mode && v.causality == "input" ? v.clocks : std::vector<std::uint32_t>()};
  }

  /// The start value as the scenario or else the FMU states it.
  double start_of(const FmuVariable& v, std::size_t element, const fmu_wire::Start& start) const {
    std::vector<std::string> values = all_starts(v);
    for (const fmu_wire::Setting& setting : start.settings)
      if (setting.reference == v.reference && setting.type == v.type) values = setting.values;
    const std::string& text = values[element];
    if (v.type == FmuType::boolean) return text == "true" || text == "1" ? 1.0 : 0.0;
    return finite_number(text).value_or(0.0);
  }

  void wire_inputs(FmuOffer& offer, fmu_wire::Start& start) const {
    for (const FmuWire& wire : r_.inputs ? *r_.inputs : all("input", offer)) {
      const auto [v, element] = find("inputs", wire.second);
      if (v->causality != "input" && !(v->causality == "parameter" && v->variability == "tunable"))
        fail("inputs", "'" + wire.second + "' has the causality " + v->causality +
                           "; allowed: inputs, and parameters with the variability tunable");
      if (!is_signal(*v))
        fail("inputs", "'" + wire.second + "' has the type " + std::string(name_of(v->type)) +
                           "; signals are numbers, whole numbers and booleans");
      const Limits limits = limits_of(*v);
      offer.inputs.push_back(
          {name_for(wire, "inputs"), v->unit, true, limits.lower, limits.upper, signal_type(v->type)});
      offer.input_start.push_back(std::clamp(start_of(*v, element, start), limits.lower, limits.upper));
      start.inputs.push_back(place_of(*v, element));
      if (v->elements > 1) {
        std::vector<std::string> values = all_starts(*v);
        for (const fmu_wire::Setting& setting : start.settings)
          if (setting.reference == v->reference && setting.type == v->type) values = setting.values;
        start.inputs.back().start = values;
      }
    }
  }

  void wire_outputs(FmuOffer& offer, fmu_wire::Start& start) const {
    for (const FmuWire& wire : r_.outputs ? *r_.outputs : all("output", offer)) {
      const auto [v, element] = find("outputs", wire.second);
      if (v->causality == "input" || v->causality == "independent")
        fail("outputs", "'" + wire.second + "' is no output but has the causality " + v->causality);
      if (!is_signal(*v))
        fail("outputs", "'" + wire.second + "' has the type " + std::string(name_of(v->type)) +
                            "; signals are numbers, whole numbers and booleans");
      offer.outputs.push_back({name_for(wire, "outputs"), v->unit, false, 0.0, 0.0, signal_type(v->type)});
      start.outputs.push_back(place_of(*v, element));
    }
    offer.output_start.assign(offer.outputs.size(), 0.0);
  }

  const FmuRequest& r_;
  const FmuDescription& fmu_;
};

bool is_below(const std::filesystem::path& root, const std::filesystem::path& file) {
  return std::mismatch(root.begin(), root.end(), file.begin(), file.end()).first == root.end();
}

std::filesystem::path library_of(const FmuDescription& fmu, const std::filesystem::path& directory,
                                 const std::set<std::string>& platforms, const std::string& device,
                                 std::vector<std::string>& notes) {
  const std::string platform(fmu.version == 2 ? kPlatform2 : kPlatform3), file = fmu.identifier + ".so";
  const std::filesystem::path folder = directory / "binaries" / platform;
  if (std::filesystem::exists(folder / file)) return folder / file;
  std::error_code none;
  std::string found, names;
  std::vector<std::filesystem::path> others;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    const std::filesystem::path name = entry.path().filename();
    if (names.size() < 200) names += (names.empty() ? "" : ", ") + printable(name.string());
    if (name.extension() == ".so") others.push_back(entry.path());
  }
  if (others.size() == 1) {
    notes.push_back(device + ": the FMU's description names the library " + file +
                    "; takes the only one there, " + printable(others.front().filename().string()) + ".");
    return others.front();
  }
  for (const std::string& other : platforms) found += (found.empty() ? "" : ", ") + other.substr(0, 40);
  throw FmuError("it has no binary for this platform, binaries/" + platform + "/" + file + "; found " +
                 (!names.empty()  ? "there only " + names
                  : found.empty() ? "no binaries"
                                  : "binaries for " + found) +
                 ". Export it for Linux on this machine" +
                 (found.empty() ? ", or compile its sources if it has some" : ""));
}

}  // namespace

FmuLibrary::FmuLibrary(std::filesystem::path allowed, std::filesystem::path host)
    : allowed_(std::move(allowed)), host_(std::move(host)) {
  if (host_.empty()) {
    std::error_code unknown;
    host_ = std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path() / "takt-fmu-host";
  }
}

std::filesystem::path FmuLibrary::allowed_file(const std::filesystem::path& file,
                                               const std::string& place) const {
  std::error_code error, no_root;
  const auto root = std::filesystem::canonical(allowed_, no_root),
             found = std::filesystem::canonical(file, error);
  bool allowed = !error && !no_root && is_below(root, found);
  for (const auto& system : systems_)
    if (const auto files = system.lock(); files && !error)
      allowed = allowed || is_below(std::filesystem::canonical(files->path()), found);
  if (!allowed)
    throw ScenarioError(place + ": found '" + file.string() +
                        "'; allowed: FMUs below the directory of --allow-fmus, " + allowed_.string());
  return found;
}

FmuSystem FmuLibrary::open_system(const std::filesystem::path& stated, const std::string& place) {
  const std::filesystem::path file = allowed_file(stated, place);
  const auto files = std::make_shared<FreshDirectory>();
  try {
    unpack_ssp(file, files->path());
    FmuSystem system = read_ssp(files->path());
    for (FmuSystem::Element& element : system.elements) {
      for (std::vector<FmuWire>* wires : {&element.inputs, &element.outputs})
        for (auto& [signal, variable] : *wires) signal = signal_name(variable);
    }
    system.files = files;
    std::erase_if(systems_, [](const auto& old) { return old.expired(); });
    systems_.push_back(files);
    return system;
  } catch (const FmuError& failure) {
    throw ScenarioError(place + ": the SSP " + file.filename().string() + ": " + failure.what());
  }
}

FmuOffer FmuLibrary::open(const FmuRequest& request) {
  const std::filesystem::path file = allowed_file(request.file, request.place("file"));
  FmuOffer offer;
  std::string tool;  // that the FMU needs
  try {
    auto files = std::make_shared<FreshDirectory>();
    const std::string sha = sha256_of(file);
    const std::set<std::string> platforms = unpack_fmu(file, files->path());
    const FileText xml =
        read_bounded_file(files->path() / "modelDescription.xml", kLargestDescription_bytes >> 20U);
    if (!xml.problem.empty()) throw FmuError("its modelDescription.xml: " + xml.problem);
    std::map<std::string, std::string> structural = request.parameters;
    for (const auto& [name, value] : request.values) structural.emplace(name, value.text);
    const FmuDescription fmu = read_model_description(xml.text, structural);
    if (fmu.needs_tool) {
      tool = fmu.generation_tool.empty() ? "the tool that made it" : fmu.generation_tool.substr(0, 100);
      offer.notes.push_back(request.device + ": the FMU states that it needs " + tool +
                            " to run (needsExecutionTool).");
    }
    auto process = std::make_shared<FmuProcessParameters>();
    process->host = host_;
    process->files = files;
    process->timeout_s = request.timeout_s;
    fmu_wire::Start& start = process->start;
    start.version = fmu.version;
    start.instance = request.device;
    start.token = fmu.token;
    start.library = library_of(fmu, files->path(), platforms, request.device, offer.notes).string();
    start.resources = (files->path() / "resources").string();
    std::filesystem::create_directories(start.resources);
    start.memory_bytes = static_cast<std::uint64_t>(request.memory_MiB) << 20U;
    start.can_copy_state = fmu.can_copy_state;
    start.can_serialise_state = fmu.can_serialise_state;
    start.tolerance = fmu.tolerance;
    start.event_mode = fmu.uses_event_mode;
    if (fmu.uses_event_mode)
      for (const FmuClock& clock : fmu.clocks)
        start.clocks.push_back({clock.reference, clock.interval_s, clock.shift_s});
    Wiring(request, fmu).connect(offer, start);
    ModelDigest digest;
    digest << sha << request.step_s << start.version;
    for (const auto& setting : start.settings) digest << setting.name << setting.values;
    for (const auto* signals : {&offer.inputs, &offer.outputs})
      for (const SignalDescription& signal : *signals) digest << signal.name << signal.lower << signal.upper;
    for (const auto* places : {&start.inputs, &start.outputs})
      for (const fmu_wire::Place& place : *places) digest << place.type << place.reference << place.element;
    offer.digest = digest.value();
    offer.make = [process] { return std::make_unique<FmuProcess>(process); };
    offer.notes.push_back(
        request.device + ": FMU " + file.filename().string() + " (FMI " + std::to_string(fmu.version) +
        ".0, model " + fmu.model_name.substr(0, 100) + ", made by " +
        (fmu.generation_tool.empty() ? "an unnamed tool" : fmu.generation_tool.substr(0, 100)) +
        (fmu.license.empty() ? "" : ", licence " + fmu.license.substr(0, 100)) + "), SHA-256 " + sha + ".");
  } catch (const FmuError& failure) {
    throw ScenarioError(request.place("file") + ": the FMU " + request.file.filename().string() + ": " +
                        failure.what());
  }
  if (const std::string why = offer.make()->restart(offer.output_start); !why.empty())
    throw ScenarioError(request.place("file") + ": the FMU " + request.file.filename().string() +
                        " cannot be initialised: " + why +
                        (tool.empty()
                             ? ""
                             : ". It needs " + tool +
                                   " (needsExecutionTool), which takt lets it neither start nor reach "
                                   "over the network; most tools can export FMUs that run by themselves"));
  return offer;
}

std::unique_ptr<FmuLibrary> fmu_library(const std::filesystem::path& allowed) {
  if (allowed.empty()) return nullptr;
  return std::make_unique<FmuLibrary>(allowed);
}

}  // namespace takt
