#include "server/components/pair_generation.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace takt {

namespace {
// The lesser of two components by this key is the Base.
auto base_key(const std::vector<Component>& components, int id) {
  const Component& c = components[static_cast<size_t>(id)];
  return std::make_tuple(static_cast<int>(c.type), c.type == ComponentType::part ? c.hierarchy : 0, id);
}
}  // namespace

std::vector<ComponentPair> generate_pairs(const std::vector<Component>& components) {
  std::vector<ComponentPair> pairs;
  const int count = static_cast<int>(components.size());
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      const PairKind kind =
          pair_kind(components[static_cast<size_t>(i)].type, components[static_cast<size_t>(j)].type);
      if (kind == PairKind::none) continue;
      ComponentPair pair{i, j, kind};
      if (base_key(components, j) < base_key(components, i)) std::swap(pair.base, pair.target);
      pairs.push_back(pair);
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const ComponentPair& a, const ComponentPair& b) {
    return std::tie(a.base, a.target) < std::tie(b.base, b.target);
  });
  return pairs;
}

}  // namespace takt
