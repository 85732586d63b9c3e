#include "server/product/exploded_view.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>

#include "server/product/geometry.h"

namespace takt::product {

namespace {

constexpr double kGap = 0.03;  ///< between parts, as a share of the product's diagonal

}  // namespace

Explosion explode(const Product& product, const Disassembly& plan) {
  const std::vector<PlacedInstance> placed = place(product);
  BoxBuilder all;
  for (const PlacedInstance& instance : placed) all.add(instance.box.lower), all.add(instance.box.upper);
  const double gap = kGap * (all.box.upper - all.box.lower).norm();
  // What each removal leaves behind: the other parts of its group.
  std::vector<std::vector<std::size_t>> behind;
  std::vector<std::size_t> group(placed.size(), 0);
  for (std::size_t k = 0; k < plan.steps.size(); ++k) {
    const std::vector<std::size_t>& parts = plan.steps[k].parts;
    const std::set<std::size_t> leaving(parts.begin(), parts.end());
    behind.emplace_back();
    for (std::size_t i = 0; i < placed.size(); ++i)
      if (group[i] == group[parts.front()] && !leaving.contains(i)) behind.back().push_back(i);
    for (const std::size_t i : parts) group[i] = k + 1;
  }
  // Backwards, so that what is left behind has its place.
  Explosion explosion(placed.size());
  const auto shift = [&](std::size_t i) {
    return std::accumulate(explosion[i].begin(), explosion[i].end(), Vec3(Vec3::Zero()));
  };
  for (std::size_t k = plan.steps.size(); k-- > 0;) {
    const RemovalStep& step = plan.steps[k];
    const Vec3 x = step.direction_W.unitOrthogonal(), y = step.direction_W.cross(x);
    const auto extents = [&](std::size_t i) {
      std::array<Extent, 3> result;
      const std::array<Vec3, 3> axes{x, y, step.direction_W};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        result[axis] = along(placed[i], axes[axis]);
        const double by = shift(i).dot(axes[axis]);
        result[axis].from += by, result[axis].to += by;
      }
      return result;
    };
    double way = gap;
    for (const std::size_t i : step.parts) {
      const auto own = extents(i);
      for (const std::size_t j : behind[k]) {
        const auto other = extents(j);
        if (own[0].meets(other[0], 0.1 * gap) && own[1].meets(other[1], 0.1 * gap))
          way = std::max(way, other[2].to - own[2].from + gap);
      }
    }
    for (const std::size_t i : step.parts) explosion[i].insert(explosion[i].begin(), way * step.direction_W);
  }
  return explosion;
}

}  // namespace takt::product
