#pragma once
// Robots in the report at one instant: motion, and for dynamic robots loads, torques, power and energy.
#include <nlohmann/json_fwd.hpp>

#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

/// By robot name; empty for a cell without robots. Torque, power and loads from LoD 2 on only.
nlohmann::ordered_json robots_json(const CellDescription& cell, const Snapshot& state);

}  // namespace takt
