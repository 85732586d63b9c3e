// The functions of FMI 3.0 of an exported cell: co-simulation. No exception leaves them. FMI wants all functions to be there;
// those of other interfaces and types answer with an error.
#include <fmi3Functions.h>

#include <limits>
#include <memory>

#include "server/fmu_export/cell_instance.h"
#include "server/fmu_export/resource_uri.h"

namespace {

struct Instance {
  fmi3LogMessageCallback logger = nullptr;
  fmi3InstanceEnvironment environment = nullptr;
  std::unique_ptr<takt::CellInstance> cell;

  fmi3Status fail(const std::string& why, fmi3Status status = fmi3Error) const {
    if (logger != nullptr)
      logger(environment, status, status == fmi3Discard ? "logStatusDiscard" : "logStatusError", why.c_str());
    return status;
  }
};

/// Runs `work(Instance&)`, which returns a status.
template <class Work>
fmi3Status guarded(fmi3Instance c, const Work& work) {
  if (c == nullptr) return fmi3Error;
  auto& instance = *static_cast<Instance*>(c);
  try {
    return work(instance);
  } catch (const std::exception& error) {
    return instance.fail(error.what());
  } catch (...) {
    return fmi3Fatal;
  }
}

/// Of an empty reason: OK.
fmi3Status done(const Instance& instance, const std::string& why) {
  return why.empty() ? fmi3OK : instance.fail(why);
}

template <class T>
fmi3Status get(fmi3Instance c, const fmi3ValueReference vr[], size_t n, T values[], size_t count,
               takt::SignalType type) {
  return guarded(c, [&](Instance& instance) {
    if (n != count) return instance.fail("all variables are scalars");
    for (size_t i = 0; i < n; ++i) {
      double value = 0.0;
      if (const std::string why = instance.cell->get(vr[i], type, value); !why.empty())
        return instance.fail(why);
      values[i] = static_cast<T>(value);
    }
    return fmi3OK;
  });
}
template <class T>
fmi3Status set(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const T values[], size_t count,
               takt::SignalType type) {
  return guarded(c, [&](Instance& instance) {
    if (n != count) return instance.fail("all variables are scalars");
    for (size_t i = 0; i < n; ++i) {
      const std::string why = instance.cell->set(vr[i], type, static_cast<double>(values[i]));
      if (!why.empty()) return instance.fail(why);
    }
    return fmi3OK;
  });
}

using State = std::vector<std::byte>;
const std::string kNoState = "there is no state: the pointer is null";

}  // namespace

const char* fmi3GetVersion() {
  return fmi3Version;
}
fmi3Status fmi3SetDebugLogging(fmi3Instance, fmi3Boolean, size_t, const fmi3String[]) {
  return fmi3OK;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                          fmi3InstanceEnvironment, fmi3LogMessageCallback) {
  return nullptr;
}
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                               fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                               fmi3ClockUpdateCallback, fmi3LockPreemptionCallback,
                                               fmi3UnlockPreemptionCallback) {
  return nullptr;
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String, fmi3String token, fmi3String resources, fmi3Boolean,
                                         fmi3Boolean, fmi3Boolean, fmi3Boolean, const fmi3ValueReference[],
                                         size_t, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback) {
  auto instance = std::make_unique<Instance>();
  instance->logger = logger, instance->environment = environment;
  try {
    if (token == nullptr || resources == nullptr) throw std::runtime_error("token and resources are needed");
    instance->cell = std::make_unique<takt::CellInstance>(takt::path_of_uri(resources), token);
  } catch (const std::exception& error) {
    instance->fail(error.what());
    return nullptr;
  } catch (...) {
    return nullptr;
  }
  return instance.release();
}
void fmi3FreeInstance(fmi3Instance c) {
  delete static_cast<Instance*>(c);
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean, fmi3Float64, fmi3Float64 start,
                                       fmi3Boolean ends, fmi3Float64 stop) {
  return guarded(c, [&](Instance& instance) {
    const std::string why =
        instance.cell->set_experiment(start, ends ? stop : std::numeric_limits<double>::infinity());
    return done(instance, why.empty() ? instance.cell->enter_initialisation() : why);
  });
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  return guarded(c, [](Instance& instance) { return done(instance, instance.cell->exit_initialisation()); });
}
fmi3Status fmi3Terminate(fmi3Instance c) {
  return guarded(c, [](Instance& instance) { return done(instance, instance.cell->terminate()); });
}
fmi3Status fmi3Reset(fmi3Instance c) {
  return guarded(c, [](Instance& instance) {
    instance.cell->reset();
    return fmi3OK;
  });
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 x[],
                          size_t count) {
  return get(c, vr, n, x, count, takt::SignalType::real);
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 x[],
                          size_t count) {
  return set(c, vr, n, x, count, takt::SignalType::real);
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Int32 x[],
                        size_t count) {
  return get(c, vr, n, x, count, takt::SignalType::integer);
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 x[],
                        size_t count) {
  return set(c, vr, n, x, count, takt::SignalType::integer);
}
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Boolean x[],
                          size_t count) {
  return get(c, vr, n, x, count, takt::SignalType::boolean);
}
fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Boolean x[],
                          size_t count) {
  return set(c, vr, n, x, count, takt::SignalType::boolean);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean, fmi3Boolean* event,
                      fmi3Boolean* ended, fmi3Boolean* early, fmi3Float64* last) {
  return guarded(c, [&](Instance& instance) {
    *event = *ended = *early = false;
    std::string why;
    const auto outcome = instance.cell->step(t, h, why);
    *last = instance.cell->value(instance.cell->time_variable());
    if (outcome == takt::CellInstance::Outcome::stepped) return fmi3OK;
    return instance.fail(why, outcome == takt::CellInstance::Outcome::discarded ? fmi3Discard : fmi3Error);
  });
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState* to) {
  return guarded(c, [&](Instance& instance) {
    auto state = std::make_unique<State>();
    if (const std::string why = instance.cell->save(*state); !why.empty()) return instance.fail(why);
    if (*to != nullptr)
      *static_cast<State*>(*to) = std::move(*state);
    else
      *to = state.release();
    return fmi3OK;
  });
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState from) {
  return guarded(c, [&](Instance& instance) {
    return done(instance, from == nullptr ? kNoState : instance.cell->restore(*static_cast<State*>(from)));
  });
}
fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState* state) {
  if (state == nullptr) return fmi3OK;
  delete static_cast<State*>(*state);
  *state = nullptr;
  return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t* size) {
  return guarded(c, [&](Instance& instance) {
    if (state == nullptr) return instance.fail(kNoState);
    *size = static_cast<State*>(state)->size();
    return fmi3OK;
  });
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte to[], size_t size) {
  return guarded(c, [&](Instance& instance) {
    if (state == nullptr) return instance.fail(kNoState);
    const State& bytes = *static_cast<State*>(state);
    if (size < bytes.size())
      return instance.fail("the state has " + std::to_string(bytes.size()) + " bytes; found room for " +
                           std::to_string(size));
    std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::byte*>(to));
    return fmi3OK;
  });
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte from[], size_t size, fmi3FMUState* state) {
  return guarded(c, [&](Instance&) {
    if (*state == nullptr) *state = new State;
    const auto* bytes = reinterpret_cast<const std::byte*>(from);
    static_cast<State*>(*state)->assign(bytes, bytes + size);
    return fmi3OK;
  });
}

// Other interfaces and types.

fmi3Status fmi3EnterEventMode(fmi3Instance) {
  return fmi3Error;
}
fmi3Status fmi3GetFloat32(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float32[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetInt8(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Int8[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetUInt8(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt8[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetInt16(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Int16[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetUInt16(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt16[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetUInt32(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt32[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetInt64(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Int64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetUInt64(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetString(fmi3Instance, const fmi3ValueReference[], size_t, fmi3String[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetBinary(fmi3Instance, const fmi3ValueReference[], size_t, size_t[], fmi3Binary[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetClock(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Clock[]) {
  return fmi3Error;
}
fmi3Status fmi3SetFloat32(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float32[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetInt8(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int8[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetUInt8(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt8[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetInt16(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int16[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetUInt16(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt16[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetUInt32(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt32[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetInt64(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetUInt64(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetString(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3String[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetBinary(fmi3Instance, const fmi3ValueReference[], size_t, const size_t[], const fmi3Binary[],
                         size_t) {
  return fmi3Error;
}
fmi3Status fmi3SetClock(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Clock[]) {
  return fmi3Error;
}
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance, fmi3ValueReference, size_t*) {
  return fmi3Error;
}
fmi3Status fmi3GetVariableDependencies(fmi3Instance, fmi3ValueReference, size_t[], fmi3ValueReference[],
                                       size_t[], fmi3DependencyKind[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance, const fmi3ValueReference[], size_t,
                                        const fmi3ValueReference[], size_t, const fmi3Float64[], size_t,
                                        fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetAdjointDerivative(fmi3Instance, const fmi3ValueReference[], size_t,
                                    const fmi3ValueReference[], size_t, const fmi3Float64[], size_t,
                                    fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3EnterConfigurationMode(fmi3Instance) {
  return fmi3Error;
}
fmi3Status fmi3ExitConfigurationMode(fmi3Instance) {
  return fmi3Error;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[],
                                  fmi3IntervalQualifier[]) {
  return fmi3Error;
}
fmi3Status fmi3GetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[],
                                   fmi3UInt64[], fmi3IntervalQualifier[]) {
  return fmi3Error;
}
fmi3Status fmi3GetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[]) {
  return fmi3Error;
}
fmi3Status fmi3GetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[],
                                fmi3UInt64[]) {
  return fmi3Error;
}
fmi3Status fmi3SetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float64[]) {
  return fmi3Error;
}
fmi3Status fmi3SetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                                   const fmi3UInt64[]) {
  return fmi3Error;
}
fmi3Status fmi3SetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float64[]) {
  return fmi3Error;
}
fmi3Status fmi3SetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                                const fmi3UInt64[]) {
  return fmi3Error;
}
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance) {
  return fmi3Error;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance, fmi3Boolean*, fmi3Boolean*, fmi3Boolean*, fmi3Boolean*,
                                    fmi3Boolean*, fmi3Float64*) {
  return fmi3Error;
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance) {
  return fmi3Error;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance, fmi3Boolean, fmi3Boolean*, fmi3Boolean*) {
  return fmi3Error;
}
fmi3Status fmi3SetTime(fmi3Instance, fmi3Float64) {
  return fmi3Error;
}
fmi3Status fmi3SetContinuousStates(fmi3Instance, const fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance, fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance, fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance, fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance, fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance, size_t*) {
  return fmi3Error;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance, size_t*) {
  return fmi3Error;
}
fmi3Status fmi3EnterStepMode(fmi3Instance) {
  return fmi3Error;
}
fmi3Status fmi3GetOutputDerivatives(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int32[],
                                    fmi3Float64[], size_t) {
  return fmi3Error;
}
fmi3Status fmi3ActivateModelPartition(fmi3Instance, fmi3ValueReference, fmi3Float64) {
  return fmi3Error;
}
