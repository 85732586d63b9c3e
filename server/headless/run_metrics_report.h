#pragma once
// What the report says of the process: its steps, what they cost, the largest loads, margins to limits.
#include <nlohmann/json_fwd.hpp>

#include "server/headless/headless_run.h"

namespace takt {

/// Section "process"; only of a run that gathered it (HeadlessOptions::run_metrics).
///  - cycle_time_s: when the last step of the program ended
///  - steps: robot, name, line, begin_s, end_s, duration_s, energy_J of each consumer
///  - consumers: energy, largest power and its time
///  - robots: of each joint range, largest speed and torque with times; of the flange, largest loads
///  - holding: largest force with which each Part was held, by whom
///  - margins: how much of its limit is used at most (`use`, 1: all of it), the most used first
nlohmann::ordered_json process_json(const CellDescription& cell, const HeadlessResult& result);

}  // namespace takt
