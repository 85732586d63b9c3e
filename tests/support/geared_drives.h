#pragma once
// Rotors behind gears for the simplified drives of a cell, as in the block scenario: without, the wrists of
// the cell of service_cell.h are too light for explicit steps of 1 ms.
#include <variant>

#include "server/simulation/model/cell_model.h"

namespace takt::test {

inline void add_rotors(CellModel& model) {
  for (auto& robot : model.dynamics) {
    for (std::size_t i = 0; i < robot->drives.size(); ++i) {
      auto& drive = std::get<SimplifiedDriveParameters>(robot->drives[i]);
      drive.gear_ratio = 101.0;
      drive.rotor_inertia_kg_m2 = i < 2 ? 2e-4 : i == 2 ? 1e-4 : 3e-5;
    }
  }
}

}  // namespace takt::test
