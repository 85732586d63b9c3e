#pragma once
// What the step loop has to tell, as fixed-size records: the loop makes no text. describe() makes the
// sentence for a person, in whatever thread sends the event.
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "idl/common/fixed_string.h"
#include "server/contact/clearance/clearance_model.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/snapshot.h"
#include "server/simulation/step/simulation.h"

namespace takt {

enum class EventCode : std::uint8_t {
  clearance,  ///< checked bodies a and b came closer than x (limit, m), now y (m); position: between them
  collision,  ///< checked bodies a and b overlap by y (depth, m); position
  clearance_restored,  ///< a and b are apart again: x limit, y least distance (m) since z (s) ago; position
  connection_changed,  ///< a: Part, b: from, c: to (components or -1)
  simulation_fault,    ///< text: the simulation's own words
  state_changed,       ///< a: new SimulationState
  reset,               ///< the cell is back in its initial state
  pace_changed,        ///< a: Pace, x: factor
  schedule_rebased,    ///< x: lag in s
  controller_registered,    ///< text: name, x: period in s
  controller_unregistered,  ///< text: name
  controller_late,          ///< text: name, a: target awaited, x: boundary in s
  controller_timeout,       ///< text: name, a: target awaited, x: boundary in s, y: time-out in s
  command_rejected,         ///< a: target, b: RejectionCode, x: stamp in s, y: boundary in s (negative: none
                            ///< awaited)
  end_of_scenario,          ///< the scenario's duration has been simulated
  level_of_detail_changed,  ///< a: process (index, -1: all), b: level
  attached,                 ///< a: Part, b: component, by request
  detached,                 ///< a: Part, by request
  entity_state_set,         ///< a: Part, by request; position: where it is now
  trajectory_done,          ///< a: robot
  trajectory_replaced,      ///< a: robot
  trajectory_refused,       ///< a: robot, b: joint (-1: it is over), c: 1 velocity, x: value, y, z: limits
  command_deadline_missed,  ///< a: robot, x: silence in s
  weak_grip,                ///< a: gripper, b: Part, x: force needed (N), y: force of each jaw (N)
  alternating_force,        ///< a: Part, b: component that presses most upon it (-1: none), x: change (N)
  save_refused,             ///< text: why the state cannot be a periodic snapshot
  events_lost,              ///< a: how many, because nobody fetched them in time
};
std::string_view to_string(EventCode code);

/// As words of a sentence: "without a scenario".
std::string_view words_of(SimulationState state);

struct EventRecord {
  EventCode code{};
  Severity severity = Severity::information;
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  int a = -1, b = -1, c = -1;
  double x = 0.0, y = 0.0, z = 0.0;
  Vec3 position_W = Vec3::Zero();
  std::uint64_t sender = 0;  ///< of the command that caused it, 0: none
  FixedString<640> text;
};

/// Why the simulation cannot go on.
EventRecord fault_record(const Simulation& simulation);

/// What happened to a commanded motion.
EventRecord motion_record(const MotionNotice& notice, std::uint32_t epoch);

/// An event for everything that there is to report of the most recent step. `emit` is called within.
void report_step(const Simulation& simulation, const std::function<void(const EventRecord&)>& emit);

struct EventText {
  std::string subject;
  std::string message;
};
EventText describe(const EventRecord& event, const CellDescription& cell);

}  // namespace takt
