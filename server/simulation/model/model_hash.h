#pragma once
// Which model a saved state belongs to.
#include <cstdint>

#include "server/simulation/model/cell_model.h"

namespace takt {

/// Of everything in the model that influences the motion: shapes, masses, constants, robots, solver, in the
/// machine's bits. Not of names of files, colours, pictures, or the name under which the cell is served. Not
/// cryptographic.
std::uint64_t model_hash(const CellModel& model);

}  // namespace takt
