#include "server/product/support.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace takt::product {

Support support_of(const std::vector<PlacedInstance>& placed, const Disassembly& plan) {
  double lowest = std::numeric_limits<double>::infinity();
  BoxBuilder all;
  for (const PlacedInstance& instance : placed) {
    lowest = std::min(lowest, instance.box.lower.z());
    all.add(instance.box.lower), all.add(instance.box.upper);
  }
  const PlacedInstance& body = placed[plan.base];
  const Vec3 size = all.box.upper - all.box.lower;
  const double margin = 0.1 * std::max(size.x(), size.y()),
               thickness = 0.05 * std::max({size.x(), size.y(), size.z()});
  constexpr double kSame_m = 1e-6;
  const auto plate = [&](double top) {
    return box_mesh(Vec3(all.box.lower.x() - margin, all.box.lower.y() - margin, top - thickness),
                    Vec3(all.box.upper.x() + margin, all.box.upper.y() + margin, top));
  };
  // Room for the tallest group that leaves downwards.
  double room = 0.0;
  for (const RemovalStep& step : plan.steps) {
    if (step.direction_W.z() > -0.5) continue;
    BoxBuilder group;
    for (const std::size_t i : step.parts) group.add(placed[i].box.lower), group.add(placed[i].box.upper);
    room = std::max(room, group.box.upper.z() - group.box.lower.z());
  }
  const bool lowest_of_all = body.box.lower.z() - lowest < kSame_m;
  if (lowest_of_all && room == 0.0) return {{plate(lowest)}, lowest};
  // Columns of a grid in which the base's lower side is flat, at its lowest height, and free below.
  const double floor_m = lowest - 0.25 * size.z() - 2.0 * room;
  std::vector<TriangleMesh> boxes{plate(floor_m)};
  constexpr int kCells = 24;
  const Vec3 from = body.box.lower, extent = body.box.upper - body.box.lower;
  std::vector<Vec3> places;
  const Vec3 cell(extent.x() / kCells, extent.y() / kCells, 0.0);
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const Vec3 lower(from.x() + i * cell.x(), from.y() + j * cell.y(), 0.0), upper = lower + cell;
      bool touches = false, free = true;
      for (const Triangle& t : body.triangles) {
        const Vec3 n = normal_of(t);
        if (n.z() > -0.999 * n.norm()) continue;
        const bool flat = std::abs(t[0].z() - from.z()) < kSame_m;
        const Vec3 middle = 0.5 * (lower + upper);
        touches = touches || (flat && covers(t, middle.x(), middle.y(), -1.0));
      }
      for (std::size_t other = 0; touches && free && other < placed.size(); ++other) {
        if (other == plan.base || placed[other].box.lower.z() > from.z()) continue;
        const Aabb& b = placed[other].box;
        free = b.upper.x() < lower.x() || b.lower.x() > upper.x() || b.upper.y() < lower.y() ||
               b.lower.y() > upper.y();
      }
      if (touches && free) places.push_back(0.5 * (lower + upper));
    }
  }
  if (places.empty()) return lowest_of_all ? Support{{plate(lowest)}, lowest} : Support{boxes, floor_m};
  // The four places that lie furthest out along the diagonals carry it.
  std::set<std::size_t> chosen;
  for (const double sx : {-1.0, 1.0})
    for (const double sy : {-1.0, 1.0}) {
      std::size_t best = 0;
      for (std::size_t k = 1; k < places.size(); ++k)
        if (sx * places[k].x() + sy * places[k].y() > sx * places[best].x() + sy * places[best].y()) best = k;
      chosen.insert(best);
    }
  for (const std::size_t k : chosen)
    boxes.push_back(box_mesh(Vec3(places[k].x() - 0.5 * cell.x(), places[k].y() - 0.5 * cell.y(), floor_m),
                             Vec3(places[k].x() + 0.5 * cell.x(), places[k].y() + 0.5 * cell.y(), from.z())));
  return {boxes, floor_m};
}

}  // namespace takt::product
