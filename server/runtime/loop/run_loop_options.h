#pragma once
// Initial state and automatic actions of a step loop.
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
  bool quit_at_end = false;            ///< and ends the loop there
  /// Called in the loop's thread with every instant, including the first one and those after a reset: for
  /// tests and for recording in-process. Empty: without.
  std::function<void(const Simulation&)> on_instant{};
  /// Period of saving the state (wall time, s) into PeriodicSaver::saved(), after changes only; 0: never.
  double save_every_s = 0.0;
  /// Of the schedule, for tests; nullptr: CLOCK_MONOTONIC. Outlives the loop.
  MonotonicClock* clock = nullptr;
  std::shared_ptr<OutboundQueue> outbound{};  ///< shared with other loops; nullptr: an own queue
  /// Registered from the start. Targets missing in the cell are left out; a controller without remaining
  /// targets is unregistered with an event.
  std::vector<requests::RegisterController> controllers{};
};

}  // namespace takt
