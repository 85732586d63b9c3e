#pragma once
// How a step loop begins, and what it does of itself.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/runtime/pacer.h"
#include "server/runtime/requests/event.h"
#include "server/runtime/requests/outbound_queue.h"
#include "takt_requests.h"

namespace takt {

struct RunLoopOptions {
  Pace pace = Pace::realtime;
  double factor = 1.0;  ///< simulated seconds per second of wall time, for realtime
  SimulationState state = SimulationState::playing;
  int realtime_priority = 0;           ///< see obtain_scheduling()
  std::optional<double> pause_at_s{};  ///< simulated time at which to pause with the event end_of_scenario
  bool quit_at_end = false;            ///< and then end the loop
  /// Called in the loop's thread with every instant, the first one and those after a reset included: for
  /// tests and for recording in-process. Empty: none.
  std::function<void(const Simulation&)> on_instant{};
  /// Saves the state so often (wall time, s) into PeriodicSaver::saved(), while anything changes; 0: never.
  double save_every_s = 0.0;
  MonotonicClock* clock =
      nullptr;  ///< of the schedule, for tests; nullptr: CLOCK_MONOTONIC. Outlives the loop
  std::shared_ptr<OutboundQueue> outbound{};  ///< to share with other loops; empty: one of its own
  /// Registered from the start. Targets that the cell does not have are left out; a controller without any is
  /// unregistered with an event.
  std::vector<requests::RegisterController> controllers{};
};

}  // namespace takt
