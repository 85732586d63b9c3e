#pragma once
// Bounds of the Parts' positions, and checks of a cell for sizes and distances that indicate a wrong unit.
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Sets cell.bounds: the box in the scenario, else the box around all components at the start and the reach
/// of all robots, grown by at least kRoom_m.
void add_world_bounds(const Scenario& scenario, CellModel& cell);

/// Margin of `add_world_bounds` around a cell (m); the diagonal of the cell, if that is longer.
inline constexpr double kRoom_m = 10.0;

/// Meshes, widths and distances beyond this (m) are a note: a file in millimetres is more likely.
inline constexpr double kOddSize_m = 10.0;
inline constexpr double kOddWidth_m = 1.0;

/// One note for each mesh, width, pose and angle of the scenario that is absurd in metres or radians, with
/// the likely remedy.
void note_units(const Scenario& scenario, CellModel& cell);

}  // namespace takt
