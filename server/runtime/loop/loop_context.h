#pragma once
// What the parts of a step loop share: the simulation, whether it plays and at which pace, and the way out for
// events and replies. For the loop's thread only.
#include "server/runtime/loop/loop_output.h"
#include "server/runtime/pacer.h"
#include "server/runtime/recording/log_recorder.h"
#include "server/simulation/step/simulation.h"

namespace takt {

struct LoopContext {
  Simulation& simulation;
  LoopOutput& output;
  SimulationState state{};
  Pace pace{};
  double factor = 1.0;              ///< simulated seconds per second of wall time, for realtime
  bool faulted = false;             ///< the simulation takes no step until a reset
  LogRecorder* recorder = nullptr;  ///< records what changes the simulation; null: nothing is recorded

  const CellDescription& cell() const { return simulation.description(); }
  bool plays() const { return state == SimulationState::playing; }

  /// At the present instant.
  EventRecord event(EventCode code, Severity severity) const {
    EventRecord record;
    record.code = code;
    record.severity = severity;
    record.time_s = simulation.time_s();
    record.step = simulation.step_index();
    record.epoch = simulation.epoch();
    return record;
  }
  void emit(const EventRecord& event) {
    output.events.push(event);
    output.news.post();
  }
  /// Where the simulation is recorded: something changed it before the present step.
  template <typename Record>
  void record(const Record& record) {
    if (recorder != nullptr) recorder->note(simulation.step_index(), record);
  }
};

}  // namespace takt
