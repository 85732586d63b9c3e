#include "server/headless/device_report.h"

namespace takt {

std::optional<double> signal_value(const CellDescription& cell, const Snapshot& state,
                                   std::string_view device, std::string_view signal) {
  const int d = cell.find_device(device);
  if (d < 0) return {};
  const std::vector<SignalDescription>& signals = cell.devices[static_cast<std::size_t>(d)].signals;
  for (std::size_t s = 0; s < signals.size(); ++s)
    if (signals[s].name == signal) return state.devices[static_cast<std::size_t>(d)].signals[s];
  return {};
}

std::vector<ConsumedEnergy> consumed_energies(const CellDescription& cell, const Snapshot& state) {
  std::vector<ConsumedEnergy> all;
  for (std::size_t r = 0; r < cell.robots.size(); ++r) {
    const RobotSample& robot = state.robots[r];
    if (robot.level_of_detail > 1)
      all.push_back({cell.robots[r].name, robot.power.electrical_energy_J, robot.power.electrical_W});
  }
  for (std::size_t d = 0; d < cell.devices.size(); ++d) {
    const auto& signals = state.devices[d].signals;
    if (const auto meter = cell.devices[d].meter())
      all.push_back({cell.devices[d].name, signals[meter->energy], signals[meter->power]});
  }
  return all;
}

}  // namespace takt
