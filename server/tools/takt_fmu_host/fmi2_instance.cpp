// FMI 2.0 (2.0.5), co-simulation: section 4.2.4 of the standard, the state machine of a slave.
#include <fmi2FunctionTypes.h>

#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "server/tools/takt_fmu_host/fmi_instance.h"

namespace takt::fmu_host {
namespace {

using fmu_wire::Place;
using fmu_wire::Setting;

void log(fmi2ComponentEnvironment, fmi2String, fmi2Status status, fmi2String, fmi2String message, ...) {
  if (status < fmi2Discard || status == fmi2Pending || message == nullptr) return;
  std::array<char, 512> text{};
  va_list arguments;
  va_start(arguments, message);
  std::vsnprintf(text.data(), text.size(), message, arguments);
  va_end(arguments);
  last_message() = text.data();
}

const char* word(fmi2Status status) {
  constexpr std::array<const char*, 6> kWords{"OK", "Warning", "Discard", "Error", "Fatal", "Pending"};
  return kWords[static_cast<std::size_t>(status) % kWords.size()];
}

/// `variable`: of which the call is, if any. Texts are made of failures alone: each step has a call for each variable.
void check(const char* call, fmi2Status status, const std::string& variable = {}) {
  if (status == fmi2OK || status == fmi2Warning) return;
  throw FmiError(with_message(std::string("the FMU answered fmi2") + word(status) + " to " + call +
                              (variable.empty() ? "" : " of '" + variable + "'")));
}

// Functions that every run needs, and others.
#define TAKT_FMI2_FUNCTIONS(use)                                                     \
  use(GetVersion) use(Instantiate) use(SetupExperiment) use(EnterInitializationMode) \
      use(ExitInitializationMode) use(DoStep)
#define TAKT_FMI2_OTHER_FUNCTIONS(use)                                                                     \
  use(GetReal) use(GetInteger) use(GetBoolean) use(SetReal) use(SetInteger) use(SetBoolean) use(SetString) \
      use(GetRealStatus) use(GetBooleanStatus) use(GetFMUstate) use(SetFMUstate) use(FreeFMUstate)         \
          use(SerializedFMUstateSize) use(SerializeFMUstate) use(DeSerializeFMUstate)

struct Functions {
#define TAKT_FMI2(name) Function<fmi2##name##TYPE> name;
  TAKT_FMI2_FUNCTIONS(TAKT_FMI2)
  TAKT_FMI2_OTHER_FUNCTIONS(TAKT_FMI2)
#undef TAKT_FMI2
};

class Instance final : public FmiInstance {
 public:
  explicit Instance(const fmu_wire::Start& start) : p_(start) {
    void* library = open_library(p_.library);
#define TAKT_FMI2(name) f_.name.find(library, "fmi2" #name);
    TAKT_FMI2_FUNCTIONS(TAKT_FMI2)
    TAKT_FMI2_OTHER_FUNCTIONS(TAKT_FMI2)
#undef TAKT_FMI2
#define TAKT_FMI2(name) f_.name.require();
    TAKT_FMI2_FUNCTIONS(TAKT_FMI2)
#undef TAKT_FMI2
    const char* version = f_.GetVersion();
    if (version == nullptr || std::string(version).rfind("2.", 0) != 0)
      throw FmiError("the library of the FMU follows FMI '" + std::string(version != nullptr ? version : "") +
                     "', its description FMI 2.0");
  }

  void start(std::span<double> outputs) override {
    const std::string uri = "file://" + p_.resources;
    c_ = f_.Instantiate(p_.instance.c_str(), fmi2CoSimulation, p_.token.c_str(), uri.c_str(), &callbacks_,
                        fmi2False, fmi2False);
    if (c_ == nullptr) throw FmiError(no_instance("fmi2Instantiate", "guid", p_.token));
    for (const Setting& setting : p_.settings) set(setting);
    check("fmi2SetupExperiment", f_.SetupExperiment(c_, p_.tolerance > 0.0 ? fmi2True : fmi2False,
                                                    p_.tolerance, 0.0, fmi2False, 0.0));
    check("fmi2EnterInitializationMode", f_.EnterInitializationMode(c_));
    check("fmi2ExitInitializationMode", f_.ExitInitializationMode(c_));
    get(outputs);
  }

  void step(double t, double h, std::span<const double> inputs, std::span<double> outputs) override {
    if (c_ == nullptr) throw FmiError("the FMU has not been started");
    if (ended_s_)
      throw FmiError(with_message("the FMU ended its simulation at " + std::to_string(*ended_s_) + " s"));
    for (std::size_t i = 0; i < inputs.size(); ++i) set(p_.inputs[i], inputs[i]);
    const fmi2Status status = f_.DoStep(c_, t, h, fmi2True);
    if (status == fmi2Pending)
      throw FmiError(
          "the FMU answered fmi2Pending to fmi2DoStep: it computes asynchronously, which takt does not take");
    if (status == fmi2Discard) {
      fmi2Boolean ended = fmi2False;
      if (f_.GetBooleanStatus) f_.GetBooleanStatus(c_, fmi2Terminated, &ended);
      fmi2Real reached = t;
      if (f_.GetRealStatus) f_.GetRealStatus(c_, fmi2LastSuccessfulTime, &reached);
      if (ended == fmi2False)
        throw FmiError(with_message("the FMU answered fmi2Discard to the step from " + std::to_string(t) +
                                    " s to " + std::to_string(t + h) + " s; it came to " +
                                    std::to_string(reached) + " s. A smaller step_s may help"));
      ended_s_ = reached;  // its outputs are those of its end
      return get(outputs);
    }
    check("fmi2DoStep", status);
    get(outputs);
  }

  void save(std::vector<std::byte>& state) override {
    fmi2FMUstate copy = nullptr;
    check("fmi2GetFMUstate", f_.GetFMUstate(c_, &copy));
    std::size_t size = 0;
    check("fmi2SerializedFMUstateSize", f_.SerializedFMUstateSize(c_, copy, &size));
    if (size > fmu_wire::kLongestMessage / 2) throw FmiError("the state of the FMU has too many bytes");
    const std::size_t before = state.size();
    state.resize(before + size);
    const fmi2Status status =
        f_.SerializeFMUstate(c_, copy, reinterpret_cast<fmi2Byte*>(state.data() + before), size);
    f_.FreeFMUstate(c_, &copy);
    check("fmi2SerializeFMUstate", status);
  }

  void load(std::span<const std::byte> state) override {
    if (c_ == nullptr) throw FmiError("the FMU has not been started");
    fmi2FMUstate copy = nullptr;
    check("fmi2DeSerializeFMUstate",
          f_.DeSerializeFMUstate(c_, reinterpret_cast<const fmi2Byte*>(state.data()), state.size(), &copy));
    const fmi2Status status = f_.SetFMUstate(c_, copy);
    f_.FreeFMUstate(c_, &copy);
    check("fmi2SetFMUstate", status);
  }

 private:
  void set(const Setting& setting) {
    const std::string& value = setting.values.front();
    const fmi2ValueReference at = setting.reference;
    if (setting.type == FmuType::text) {
      const fmi2String text = value.c_str();
      check("fmi2SetString", f_.SetString(c_, &at, 1, &text), setting.name);
    } else if (setting.type == FmuType::boolean) {
      const fmi2Boolean flag = value == "true" ? fmi2True : fmi2False;
      check("fmi2SetBoolean", f_.SetBoolean(c_, &at, 1, &flag), setting.name);
    } else {
      set({setting.name, setting.type, setting.reference, 1, 0, {}}, std::strtod(value.c_str(), nullptr));
    }
  }

  void set(const Place& place, double value) {
    const fmi2ValueReference at = place.reference;
    if (place.type == FmuType::float64) {
      check("fmi2SetReal", f_.SetReal(c_, &at, 1, &value), place.name);
    } else if (place.type == FmuType::boolean) {
      const fmi2Boolean flag = value >= 0.5 ? fmi2True : fmi2False;
      check("fmi2SetBoolean", f_.SetBoolean(c_, &at, 1, &flag), place.name);
    } else {
      const auto whole = static_cast<fmi2Integer>(std::lround(value));
      check("fmi2SetInteger", f_.SetInteger(c_, &at, 1, &whole), place.name);
    }
  }

  void get(std::span<double> outputs) {
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const Place& place = p_.outputs[i];
      const fmi2ValueReference at = place.reference;
      if (place.type == FmuType::float64) {
        check("fmi2GetReal", f_.GetReal(c_, &at, 1, &outputs[i]), place.name);
      } else if (place.type == FmuType::boolean) {
        fmi2Boolean flag = fmi2False;
        check("fmi2GetBoolean", f_.GetBoolean(c_, &at, 1, &flag), place.name);
        outputs[i] = flag != fmi2False ? 1.0 : 0.0;
      } else {
        fmi2Integer whole = 0;
        check("fmi2GetInteger", f_.GetInteger(c_, &at, 1, &whole), place.name);
        outputs[i] = whole;
      }
    }
  }

  fmu_wire::Start p_;
  Functions f_;
  fmi2Component c_ = nullptr;
  std::optional<double> ended_s_;
  fmi2CallbackFunctions callbacks_{&log, &std::calloc, &std::free, nullptr, nullptr};
};

}  // namespace

std::unique_ptr<FmiInstance> load_fmi2(const fmu_wire::Start& start) {
  return std::make_unique<Instance>(start);
}

}  // namespace takt::fmu_host
