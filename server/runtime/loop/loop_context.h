#pragma once
// Shared state of the parts of a step loop: the simulation, its play state and pace, and the output of events
// and replies. For the loop's thread only.
#include <cstdint>
#include <string>
#include <utility>

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
  LogRecorder* recorder = nullptr;  ///< records changes of the simulation; nullptr: without recording

  const CellDescription& cell() const { return simulation.description(); }
  bool plays() const { return state == SimulationState::playing; }

  /// At the present instant. `sender`: of the command that caused the event; 0: none.
  EventRecord record_of(const events::OfLoop& event, std::uint64_t sender = 0) const {
    return {simulation.time_s(), simulation.step_index(), simulation.epoch(), sender, event};
  }
  void emit(const EventRecord& record) {
    output.events.push(record);
    output.news.post();
  }
  void emit(const events::OfLoop& event) { emit(record_of(event)); }
  /// If a recording runs: records a change of the simulation ahead of the present step.
  template <typename Record>
  void record(const Record& record) {
    if (recorder != nullptr) recorder->note(simulation.step_index(), record);
  }
  void reply(ControlReply reply) { output.outbound->add_reply(std::move(reply)); }
};

}  // namespace takt
