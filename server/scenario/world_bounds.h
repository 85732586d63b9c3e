#pragma once
// Where Parts may be, and what of a cell is so large or so far away that a unit must be wrong.
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Sets cell.bounds: what the scenario says, else the box around all components at the start and all that the
/// robots reach, with at least kRoom_m around it.
void add_world_bounds(const Scenario& scenario, CellModel& cell);

/// What `add_world_bounds` leaves around a cell (m), or the diagonal of the cell, if that is longer.
inline constexpr double kRoom_m = 10.0;

/// Meshes, widths and distances beyond this (m) are a note: a file in millimetres is more likely.
inline constexpr double kOddSize_m = 10.0;
inline constexpr double kOddWidth_m = 1.0;

/// One note for each mesh, width, pose and angle of the scenario that is absurd in metres or radians, with
/// the likely remedy.
void note_units(const Scenario& scenario, CellModel& cell);

}  // namespace takt
