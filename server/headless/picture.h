#pragma once
// A picture of the cell at one instant, drawn from the simulation's own description and snapshot.
#include <string>

#include "server/simulation/cell_description.h"
#include "server/simulation/snapshot.h"

namespace takt {

/// Writes a PNG. Throws std::runtime_error when it cannot be written.
void write_picture(const CellDescription& cell, const Snapshot& snapshot, const std::string& png_file);

}  // namespace takt
