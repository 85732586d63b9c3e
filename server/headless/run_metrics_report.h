#pragma once
// Metrics in the report: the program's steps, their energy, the largest loads, margins to limits.
#include <nlohmann/json_fwd.hpp>

#include "server/headless/headless_run.h"

namespace takt {

/// Section "run_metrics"; only of a run with metrics (HeadlessOptions::run_metrics).
///  - cycle_time: end of the program's last step
///  - steps: robot, name, line, begin, end, duration, electrical_energy of each consumer
///  - consumers: energy, largest power and its time
///  - robots: of each joint range, largest speed and effort with times; of the flange, largest loads
///  - holding: largest force on each Part, with its holder
///  - margins: largest used share of each limit (`use`, 1: all of it), the largest first
nlohmann::ordered_json run_metrics_json(const CellDescription& cell, const HeadlessResult& result);

}  // namespace takt
