// FMI 3.0, co-simulation: section 4.2 of the standard. Event mode is used where clocks tick; other FMUs handle their events.
#include <fmi3FunctionTypes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <string_view>
#include <type_traits>

#include "server/tools/takt_fmu_host/fmi_instance.h"

namespace takt::fmu_host {
namespace {

using fmu_wire::Place;
using fmu_wire::Setting;

void log(fmi3InstanceEnvironment, fmi3Status status, fmi3String, fmi3String message) {
  if (status < fmi3Discard || message == nullptr) return;
  last_message() = std::string(message).substr(0, 500);
}

/// `variable`: of which the call is, if any. Texts are made of failures alone: each step has a call for each variable.
void check(const char* call, fmi3Status status, std::string_view variable = {}) {
  constexpr std::array<const char*, 5> kWords{"OK", "Warning", "Discard", "Error", "Fatal"};
  if (status == fmi3OK || status == fmi3Warning) return;
  throw FmiError(with_message(std::string("the FMU answered fmi3") +
                              kWords[static_cast<std::size_t>(status) % kWords.size()] + " to " + call +
                              (variable.empty() ? "" : " '" + std::string(variable) + "'")));
}

/// Numbers as texts: whole ones with all their digits.
template <class T>
T number_of(const std::string& text) {
  if constexpr (std::is_same_v<T, bool>)
    return text == "true" || text == "1";
  else if constexpr (std::is_same_v<T, std::uint64_t>)
    return text.find_first_of(".eE-") == std::string::npos
               ? std::strtoull(text.c_str(), nullptr, 10)
               : static_cast<T>(std::strtod(text.c_str(), nullptr));
  else if constexpr (std::is_integral_v<T>)
    return static_cast<T>(text.find_first_of(".eE") == std::string::npos
                              ? std::strtoll(text.c_str(), nullptr, 10)
                              : static_cast<long long>(std::strtod(text.c_str(), nullptr)));
  else
    return static_cast<T>(std::strtod(text.c_str(), nullptr));
}

template <class T>
T to_type(double value) {
  if constexpr (std::is_same_v<T, bool>)
    return value >= 0.5;
  else if constexpr (std::is_integral_v<T>)
    return static_cast<T>(std::llround(value));
  else
    return static_cast<T>(value);
}

// Functions that every run needs, and others.
#define TAKT_FMI3_FUNCTIONS(use)                                                                        \
  use(GetVersion) use(InstantiateCoSimulation) use(EnterInitializationMode) use(ExitInitializationMode) \
      use(DoStep)
#define TAKT_FMI3_OTHER_FUNCTIONS(use)                                                                      \
  use(EnterEventMode) use(EnterStepMode) use(UpdateDiscreteStates) use(SetClock) use(GetClock)              \
      use(EnterConfigurationMode) use(ExitConfigurationMode) use(SetString) use(GetFloat64) use(SetFloat64) \
          use(GetFloat32) use(SetFloat32) use(GetInt8) use(SetInt8) use(GetUInt8) use(SetUInt8)             \
              use(GetInt16) use(SetInt16) use(GetUInt16) use(SetUInt16) use(GetInt32) use(SetInt32)         \
                  use(GetUInt32) use(SetUInt32) use(GetInt64) use(SetInt64) use(GetUInt64) use(SetUInt64)   \
                      use(GetBoolean) use(SetBoolean) use(GetFMUState) use(SetFMUState) use(FreeFMUState)   \
                          use(SerializedFMUStateSize) use(SerializeFMUState) use(DeserializeFMUState)

class Instance final : public FmiInstance {
 public:
  explicit Instance(const fmu_wire::Start& start) : p_(start) {
    void* library = open_library(p_.library);
#define TAKT_FMI3(name) name##_.find(library, "fmi3" #name);
    TAKT_FMI3_FUNCTIONS(TAKT_FMI3)
    TAKT_FMI3_OTHER_FUNCTIONS(TAKT_FMI3)
#undef TAKT_FMI3
#define TAKT_FMI3(name) name##_.require();
    TAKT_FMI3_FUNCTIONS(TAKT_FMI3)
#undef TAKT_FMI3
    const char* version = GetVersion_();
    if (version == nullptr || std::string(version).rfind("3.", 0) != 0)
      throw FmiError("the library of the FMU follows FMI '" + std::string(version != nullptr ? version : "") +
                     "', its description FMI 3.0");
  }

  void start(std::span<double> outputs) override {
    const std::string path = p_.resources + "/";
    c_ = InstantiateCoSimulation_(p_.instance.c_str(), p_.token.c_str(), path.c_str(), false, false,
                                  p_.event_mode, false, nullptr, 0, nullptr, &log, nullptr);
    if (c_ == nullptr)
      throw FmiError(no_instance("fmi3InstantiateCoSimulation", "instantiationToken", p_.token));
    configure();
    for (const Setting& setting : p_.settings)
      if (!setting.structural) set(setting);
    check("fmi3EnterInitializationMode",
          EnterInitializationMode_(c_, p_.tolerance > 0.0, p_.tolerance, 0.0, false, 0.0));
    check("fmi3ExitInitializationMode", ExitInitializationMode_(c_));
    ticks_.assign(p_.outputs.size(), false);
    if (p_.event_mode) end_event();
    for (const Place& place : p_.inputs) {
      if (place.elements <= 1) continue;
      Array& array = arrays_[{place.type, place.reference}];
      array.place = &place;
      std::vector<double>& all = array.values;
      all.clear();
      for (const std::string& text : place.start)
        all.push_back(place.type == FmuType::boolean ? (text == "true" || text == "1" ? 1.0 : 0.0)
                                                     : std::strtod(text.c_str(), nullptr));
    }
    get(outputs);
  }

  void step(double t, double h, std::span<const double> inputs, std::span<double> outputs) override {
    if (c_ == nullptr) throw FmiError("the FMU has not been started");
    if (ended_s_)
      throw FmiError(with_message("the FMU ended its simulation at " + std::to_string(*ended_s_) + " s"));
    if (p_.event_mode) {
      check("fmi3EnterEventMode", EnterEventMode_(c_));
      tick(t, h, inputs);
    }
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const Place& place = p_.inputs[i];
      if (!is_present(place)) continue;
      if (place.elements > 1)
        arrays_[{place.type, place.reference}].values[place.element] = inputs[i];
      else
        set_numbers(place.name, place.type, place.reference, {&inputs[i], 1});
    }
    for (const auto& [of, array] : arrays_)
      if (is_present(*array.place)) set_numbers(array.place->name, of.first, of.second, array.values);
    std::fill(ticks_.begin(), ticks_.end(), false);
    if (p_.event_mode) end_event();
    constexpr int kMostParts = 1000;
    double at = t;
    for (int part = 0; at < t + h && part < kMostParts; ++part) {
      bool event = false, ended = false, early = false;
      double reached = t + h;
      check("fmi3DoStep", DoStep_(c_, at, t + h - at, true, &event, &ended, &early, &reached));
      if (event && p_.event_mode) {
        check("fmi3EnterEventMode", EnterEventMode_(c_));
        end_event();
      }
      // Its outputs are those of its end.
      if (ended) ended_s_ = reached;
      if (!early || ended) break;
      if (!(reached > at) || part + 1 == kMostParts)
        throw FmiError("the FMU returns early from its step and does not come on from " + std::to_string(at) +
                       " s");
      at = reached;
    }
    get(outputs);
  }

  void save(std::vector<std::byte>& state) override {
    fmi3FMUState copy = nullptr;
    check("fmi3GetFMUState", GetFMUState_(c_, &copy));
    std::size_t size = 0;
    check("fmi3SerializedFMUStateSize", SerializedFMUStateSize_(c_, copy, &size));
    if (size > fmu_wire::kLongestMessage / 2) throw FmiError("the state of the FMU has too many bytes");
    const std::size_t before = state.size();
    state.resize(before + size);
    const fmi3Status status =
        SerializeFMUState_(c_, copy, reinterpret_cast<fmi3Byte*>(state.data() + before), size);
    FreeFMUState_(c_, &copy);
    check("fmi3SerializeFMUState", status);
  }

  void load(std::span<const std::byte> state) override {
    if (c_ == nullptr) throw FmiError("the FMU has not been started");
    fmi3FMUState copy = nullptr;
    check("fmi3DeserializeFMUState",
          DeserializeFMUState_(c_, reinterpret_cast<const fmi3Byte*>(state.data()), state.size(), &copy));
    const fmi3Status status = SetFMUState_(c_, copy);
    FreeFMUState_(c_, &copy);
    check("fmi3SetFMUState", status);
  }

 private:
  /// An input that belongs to clocks can be set at their ticks alone; a clock is no value.
  bool is_present(const Place& place) const {
    return place.type != FmuType::clock &&
           (place.clocks.empty() ||
            std::any_of(place.clocks.begin(), place.clocks.end(), [this](std::uint32_t clock) {
              return std::find(ticking_.begin(), ticking_.end(), clock) != ticking_.end();
            }));
  }

  /// The clocks that tick in (t - h, t], and those whose signals are 1.
  void tick(double t, double h, std::span<const double> inputs) {
    ticking_.clear();
    for (const fmu_wire::Clock& clock : p_.clocks) {
      const auto count = [&](double at) {
        return std::floor((at - clock.shift_s) / clock.interval_s + 1e-6);
      };
      if (count(t) < 0.0 || count(t) <= count(t - h)) continue;
      ticking_.push_back(clock.reference);
    }
    for (std::size_t i = 0; i < inputs.size(); ++i)
      if (p_.inputs[i].type == FmuType::clock && inputs[i] >= 0.5) ticking_.push_back(p_.inputs[i].reference);
    const fmi3Clock active = fmi3ClockActive;
    for (const fmi3ValueReference clock : ticking_) check("fmi3SetClock", SetClock_(c_, &clock, 1, &active));
  }

  /// What clocks tell of themselves is gone with the update.
  void hear_clocks() {
    for (std::size_t i = 0; i < p_.outputs.size(); ++i) {
      if (p_.outputs[i].type != FmuType::clock) continue;
      const fmi3ValueReference at = p_.outputs[i].reference;
      fmi3Clock ticks = fmi3ClockInactive;
      check("fmi3GetClock", GetClock_(c_, &at, 1, &ticks), p_.outputs[i].name);
      ticks_[i] = ticks_[i] || ticks == fmi3ClockActive;
    }
  }

  /// From event mode back to the steps.
  void end_event() {
    constexpr int kMostUpdates = 1000;
    bool again = true;
    for (int i = 0; again; ++i) {
      bool ended = false, nominals = false, values = false, has_next = false;
      double next_s = 0.0;
      hear_clocks();
      check("fmi3UpdateDiscreteStates",
            UpdateDiscreteStates_(c_, &again, &ended, &nominals, &values, &has_next, &next_s));
      if (ended) throw FmiError(with_message("the FMU ended its simulation at an event"));
      if (i == kMostUpdates) throw FmiError("the FMU does not come to the end of an event");
    }
    check("fmi3EnterStepMode", EnterStepMode_(c_));
  }

  /// Sizes of arrays are set ahead of all else, in a mode of their own.
  void configure() {
    const auto structural = [](const Setting& setting) { return setting.structural; };
    if (std::none_of(p_.settings.begin(), p_.settings.end(), structural)) return;
    check("fmi3EnterConfigurationMode", EnterConfigurationMode_(c_));
    for (const Setting& setting : p_.settings)
      if (setting.structural) set(setting);
    check("fmi3ExitConfigurationMode", ExitConfigurationMode_(c_));
  }

  /// Calls `use(T{}, getter, setter, names)` with the type of the language for a type of FMI.
  template <class Use>
  void with_type(FmuType type, const Use& use) {
    switch (type) {
      case FmuType::float64:
        return use(fmi3Float64{}, GetFloat64_, SetFloat64_);
      case FmuType::float32:
        return use(fmi3Float32{}, GetFloat32_, SetFloat32_);
      case FmuType::int8:
        return use(fmi3Int8{}, GetInt8_, SetInt8_);
      case FmuType::uint8:
        return use(fmi3UInt8{}, GetUInt8_, SetUInt8_);
      case FmuType::int16:
        return use(fmi3Int16{}, GetInt16_, SetInt16_);
      case FmuType::uint16:
        return use(fmi3UInt16{}, GetUInt16_, SetUInt16_);
      case FmuType::int32:
        return use(fmi3Int32{}, GetInt32_, SetInt32_);
      case FmuType::uint32:
        return use(fmi3UInt32{}, GetUInt32_, SetUInt32_);
      case FmuType::uint64:
        return use(fmi3UInt64{}, GetUInt64_, SetUInt64_);
      case FmuType::boolean:
        return use(fmi3Boolean{}, GetBoolean_, SetBoolean_);
      default:
        return use(fmi3Int64{}, GetInt64_, SetInt64_);  // enumerations too
    }
  }

  void set(const Setting& setting) {
    const fmi3ValueReference at = setting.reference;
    if (setting.type == FmuType::text) {
      std::vector<fmi3String> texts;
      for (const std::string& value : setting.values) texts.push_back(value.c_str());
      return check("setting", SetString_(c_, &at, 1, texts.data(), texts.size()), setting.name);
    }
    with_type(setting.type, [&]<class T>(T, auto, auto setter) {
      const std::unique_ptr<T[]> values(new T[setting.values.size()]);
      for (std::size_t i = 0; i < setting.values.size(); ++i) values[i] = number_of<T>(setting.values[i]);
      check("setting", setter(c_, &at, 1, values.get(), setting.values.size()), setting.name);
    });
  }

  void set_numbers(std::string_view name, FmuType type, fmi3ValueReference at,
                   std::span<const double> numbers) {
    with_type(type, [&]<class T>(T, auto, auto setter) {
      const std::unique_ptr<T[]> values(new T[numbers.size()]);
      for (std::size_t i = 0; i < numbers.size(); ++i) values[i] = to_type<T>(numbers[i]);
      check("setting the input", setter(c_, &at, 1, values.get(), numbers.size()), name);
    });
  }

  void get(std::span<double> outputs) {
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const Place& place = p_.outputs[i];
      const fmi3ValueReference at = place.reference;
      if (place.type == FmuType::clock) {
        outputs[i] = ticks_[i] ? 1.0 : 0.0;
        continue;
      }
      with_type(place.type, [&]<class T>(T, auto getter, auto) {
        const std::unique_ptr<T[]> values(new T[place.elements]());
        check("reading", getter(c_, &at, 1, values.get(), place.elements), place.name);
        outputs[i] = static_cast<double>(values[place.element]);
      });
    }
  }

  fmu_wire::Start p_;
  fmi3Instance c_ = nullptr;
  std::optional<double> ended_s_;
  std::vector<fmi3ValueReference> ticking_;  ///< input clocks of this step
  std::vector<bool> ticks_;                  ///< by output: a clock that has ticked in this step
  struct Array {
    const Place* place = nullptr;  ///< of one of its elements
    std::vector<double> values;
  };
  std::map<std::pair<FmuType, fmi3ValueReference>, Array> arrays_;  ///< inputs
#define TAKT_FMI3(name) Function<fmi3##name##TYPE> name##_;
  TAKT_FMI3_FUNCTIONS(TAKT_FMI3)
  TAKT_FMI3_OTHER_FUNCTIONS(TAKT_FMI3)
#undef TAKT_FMI3
};

}  // namespace

std::unique_ptr<FmiInstance> load_fmi3(const fmu_wire::Start& start) {
  return std::make_unique<Instance>(start);
}

}  // namespace takt::fmu_host
