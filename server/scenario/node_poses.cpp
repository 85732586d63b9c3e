#include <algorithm>

#include "server/geometry/mesh/import.h"
#include "server/scenario/cell_builders.h"

namespace takt {

namespace {

template <class Item>
bool has_at_node(const std::vector<Item>& items) {
  return std::any_of(items.begin(), items.end(), [](const Item& item) { return item.at_node; });
}

template <class Item>
void place(std::vector<Item>& items, MeshFiles& files) {
  for (Item& item : items) {
    if (!item.at_node) continue;
    item.X_WB = item.X_WB * upright(list_mesh_nodes(item.mesh, item.mesh_scale, files).front().X_FN);
    item.at_node = false;
  }
}

}  // namespace

std::optional<Scenario> placed_at_nodes(const Scenario& scenario, MeshFiles& files) {
  if (!has_at_node(scenario.parts) && !has_at_node(scenario.grounds)) return {};
  Scenario placed = scenario;
  place(placed.parts, files);
  place(placed.grounds, files);
  return placed;
}

}  // namespace takt
