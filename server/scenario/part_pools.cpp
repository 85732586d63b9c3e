#include <algorithm>

#include "server/devices/part_flow.h"
#include "server/scenario/cell_builders.h"

namespace takt {

namespace {
// Parked Parts lie in a row, this far below the origin (m), and so far from each other.
constexpr double kBelow_m = 1000.0, kBetween_m = 0.1;
}  // namespace

std::optional<Scenario> with_pools(const Scenario& scenario) {
  if (scenario.pools.empty()) return {};
  Scenario filled = scenario;
  for (const ScenarioPool& pool : scenario.pools) {
    ScenarioPart part = pool.part;
    for (const StatedDevice& device : scenario.devices) {
      const auto* source = std::any_cast<ScenarioSource>(&device.section);
      if (source == nullptr || source->pool != pool.name) continue;
      part.X_WB = source->X_WB;
      break;
    }
    for (int i = 1; i <= pool.count; ++i) {
      part.name = pool.part_name(i);
      filled.parts.push_back(part);
    }
    for (ScenarioProcess& process : filled.processes) {
      if (std::find(process.members.begin(), process.members.end(), pool.name) == process.members.end())
        continue;
      for (int i = 1; i <= pool.count; ++i) process.members.push_back(pool.part_name(i));
    }
  }
  return filled;
}

void add_pools(const Scenario& scenario, CellModel& cell) {
  double x_m = 0.0;
  for (const ScenarioPool& stated : scenario.pools) {
    PartPool pool;
    pool.name = stated.name;
    for (int i = 1; i <= stated.count; ++i) {
      const int part = cell.description.find_component(stated.part_name(i));
      const Component& component = cell.components[static_cast<std::size_t>(part)];
      const double reach_m = component.box.center_B.norm() + component.box.half_B.norm();
      const auto is_it = [part](const RigidBodyParameters& body) { return body.body == part; };
      RigidBodyParameters& body = *std::find_if(cell.parts.begin(), cell.parts.end(), is_it);
      x_m += reach_m;
      body.X_WB_initial = {Mat3::Identity(), Vec3(x_m, 0.0, -kBelow_m)};
      body.V_WB_initial = {};
      x_m += reach_m + kBetween_m;
      pool.parts.push_back(part);
    }
    cell.pools.push_back(std::move(pool));
  }
}

}  // namespace takt
