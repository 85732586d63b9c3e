#pragma once
// Signals of devices, and the energy drawn by robots and devices.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

struct ConsumedEnergy {
  std::string_view consumer;  ///< a name of the cell
  double energy_J = 0.0, power_W = 0.0;
};
/// Of every robot above level of detail 1, and of every device that has signals energy (J) and power (W).
std::vector<ConsumedEnergy> consumed_energies(const CellDescription& cell, const Snapshot& state);

/// The value of a device's signal, if it has one of this name.
std::optional<double> signal_value(const CellDescription& cell, const Snapshot& state,
                                   std::string_view device, std::string_view signal);

}  // namespace takt
