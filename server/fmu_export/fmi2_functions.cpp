// The functions of FMI 2.0 (2.0.5) of an exported cell: co-simulation. No exception leaves them.
#include <fmi2Functions.h>

#include <limits>
#include <memory>

#include "server/fmu_export/cell_instance.h"
#include "server/fmu_export/resource_uri.h"

namespace {

struct Component {
  std::string name;
  fmi2CallbackLogger logger = nullptr;
  fmi2ComponentEnvironment environment = nullptr;
  std::unique_ptr<takt::CellInstance> cell;

  fmi2Status fail(const std::string& why, fmi2Status status = fmi2Error) const {
    if (logger == nullptr) return status;
    // The message is a format. Not every importer fills one in, so it has no arguments.
    std::string message;
    for (const char c : why) message += c == '%' ? "%%" : std::string(1, c);
    logger(environment, name.c_str(), status, status == fmi2Discard ? "logStatusDiscard" : "logStatusError",
           message.c_str());
    return status;
  }
};

/// Runs `work(Component&)`, which returns a status.
template <class Work>
fmi2Status guarded(fmi2Component c, const Work& work) {
  if (c == nullptr) return fmi2Error;
  auto& component = *static_cast<Component*>(c);
  try {
    return work(component);
  } catch (const std::exception& error) {
    return component.fail(error.what());
  } catch (...) {
    return fmi2Fatal;
  }
}

/// Of an empty reason: OK.
fmi2Status done(const Component& component, const std::string& why) {
  return why.empty() ? fmi2OK : component.fail(why);
}

template <class T>
fmi2Status get(fmi2Component c, const fmi2ValueReference vr[], size_t n, T values[], takt::SignalType type) {
  return guarded(c, [&](Component& component) {
    for (size_t i = 0; i < n; ++i) {
      double value = 0.0;
      if (const std::string why = component.cell->get(vr[i], type, value); !why.empty())
        return component.fail(why);
      values[i] = static_cast<T>(value);
    }
    return fmi2OK;
  });
}
template <class T>
fmi2Status set(fmi2Component c, const fmi2ValueReference vr[], size_t n, const T values[],
               takt::SignalType type) {
  return guarded(c, [&](Component& component) {
    for (size_t i = 0; i < n; ++i) {
      // Of booleans, which are integers, all but 0 is true.
      const double value = type != takt::SignalType::boolean ? static_cast<double>(values[i])
                           : values[i] != T{}                ? 1.0
                                                             : 0.0;
      if (const std::string why = component.cell->set(vr[i], type, value); !why.empty())
        return component.fail(why);
    }
    return fmi2OK;
  });
}

using State = std::vector<std::byte>;
const std::string kNoState = "there is no state: the pointer is null";

}  // namespace

const char* fmi2GetTypesPlatform() {
  return fmi2TypesPlatform;
}
const char* fmi2GetVersion() {
  return fmi2Version;
}
fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean, size_t, const fmi2String[]) {
  return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean) {
  auto component = std::make_unique<Component>();
  component->name = name != nullptr ? name : "";
  if (functions != nullptr)
    component->logger = functions->logger, component->environment = functions->componentEnvironment;
  try {
    if (type != fmi2CoSimulation) throw std::runtime_error("this FMU is for co-simulation alone");
    if (guid == nullptr || resources == nullptr) throw std::runtime_error("guid and resources are needed");
    component->cell = std::make_unique<takt::CellInstance>(takt::path_of_uri(resources), guid);
  } catch (const std::exception& error) {
    component->fail(error.what());
    return nullptr;
  } catch (...) {
    return nullptr;
  }
  return component.release();
}
void fmi2FreeInstance(fmi2Component c) {
  delete static_cast<Component*>(c);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean, fmi2Real, fmi2Real start, fmi2Boolean ends,
                               fmi2Real stop) {
  return guarded(c, [&](Component& component) {
    return done(component, component.cell->set_experiment(
                               start, ends != fmi2False ? stop : std::numeric_limits<double>::infinity()));
  });
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  return guarded(
      c, [](Component& component) { return done(component, component.cell->enter_initialisation()); });
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  return guarded(c,
                 [](Component& component) { return done(component, component.cell->exit_initialisation()); });
}
fmi2Status fmi2Terminate(fmi2Component c) {
  return guarded(c, [](Component& component) { return done(component, component.cell->terminate()); });
}
fmi2Status fmi2Reset(fmi2Component c) {
  return guarded(c, [](Component& component) {
    component.cell->reset();
    return fmi2OK;
  });
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real x[]) {
  return get(c, vr, n, x, takt::SignalType::real);
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer x[]) {
  return get(c, vr, n, x, takt::SignalType::integer);
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean x[]) {
  return get(c, vr, n, x, takt::SignalType::boolean);
}
fmi2Status fmi2GetString(fmi2Component, const fmi2ValueReference[], size_t n, fmi2String[]) {
  return n == 0 ? fmi2OK : fmi2Error;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real x[]) {
  return set(c, vr, n, x, takt::SignalType::real);
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer x[]) {
  return set(c, vr, n, x, takt::SignalType::integer);
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean x[]) {
  return set(c, vr, n, x, takt::SignalType::boolean);
}
fmi2Status fmi2SetString(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2String[]) {
  return n == 0 ? fmi2OK : fmi2Error;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean) {
  return guarded(c, [&](Component& component) {
    std::string why;
    const auto outcome = component.cell->step(t, h, why);
    if (outcome == takt::CellInstance::Outcome::stepped) return fmi2OK;
    return component.fail(why, outcome == takt::CellInstance::Outcome::discarded ? fmi2Discard : fmi2Error);
  });
}
fmi2Status fmi2CancelStep(fmi2Component) {
  return fmi2Error;
}
fmi2Status fmi2GetStatus(fmi2Component, const fmi2StatusKind, fmi2Status*) {
  return fmi2Discard;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value) {
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  return guarded(c, [&](Component& component) {
    *value = component.cell->value(component.cell->time_variable());
    return fmi2OK;
  });
}
fmi2Status fmi2GetIntegerStatus(fmi2Component, const fmi2StatusKind, fmi2Integer*) {
  return fmi2Discard;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component, const fmi2StatusKind kind, fmi2Boolean* value) {
  if (kind != fmi2Terminated) return fmi2Discard;
  *value = fmi2False;
  return fmi2OK;
}
fmi2Status fmi2GetStringStatus(fmi2Component, const fmi2StatusKind, fmi2String*) {
  return fmi2Discard;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Integer[],
                                       const fmi2Real[]) {
  return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component, const fmi2ValueReference[], size_t,
                                        const fmi2Integer[], fmi2Real[]) {
  return fmi2Error;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component, const fmi2ValueReference[], size_t,
                                        const fmi2ValueReference[], size_t, const fmi2Real[], fmi2Real[]) {
  return fmi2Error;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* to) {
  return guarded(c, [&](Component& component) {
    auto state = std::make_unique<State>();
    if (const std::string why = component.cell->save(*state); !why.empty()) return component.fail(why);
    if (*to != nullptr)
      *static_cast<State*>(*to) = std::move(*state);
    else
      *to = state.release();
    return fmi2OK;
  });
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate from) {
  return guarded(c, [&](Component& component) {
    return done(component, from == nullptr ? kNoState : component.cell->restore(*static_cast<State*>(from)));
  });
}
fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate* state) {
  if (state == nullptr) return fmi2OK;
  delete static_cast<State*>(*state);
  *state = nullptr;
  return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t* size) {
  return guarded(c, [&](Component& component) {
    if (state == nullptr) return component.fail(kNoState);
    *size = static_cast<State*>(state)->size();
    return fmi2OK;
  });
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte to[], size_t size) {
  return guarded(c, [&](Component& component) {
    if (state == nullptr) return component.fail(kNoState);
    const State& bytes = *static_cast<State*>(state);
    if (size < bytes.size())
      return component.fail("the state has " + std::to_string(bytes.size()) + " bytes; found room for " +
                            std::to_string(size));
    std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::byte*>(to));
    return fmi2OK;
  });
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte from[], size_t size, fmi2FMUstate* state) {
  return guarded(c, [&](Component&) {
    if (*state == nullptr) *state = new State;
    const auto* bytes = reinterpret_cast<const std::byte*>(from);
    static_cast<State*>(*state)->assign(bytes, bytes + size);
    return fmi2OK;
  });
}
