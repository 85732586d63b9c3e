#include "server/components/pair_generation.h"

#include <tuple>

namespace takt {

namespace {
// The lesser of two components by this key is the Base.
auto base_key(const std::vector<Component>& components, int id) {
  const Component& c = components[static_cast<size_t>(id)];
  return std::make_tuple(static_cast<int>(c.type), c.type == ComponentType::part ? c.hierarchy : 0, id);
}
}  // namespace

bool base_first(const std::vector<Component>& components, int a, int b) {
  return base_key(components, a) < base_key(components, b);
}

ComponentPairs generate_pairs(const std::vector<Component>& components) {
  ComponentPairs pairs;
  const int count = static_cast<int>(components.size());
  for (int base = 0; base < count; ++base) {
    for (int target = 0; target < count; ++target) {
      const PairKind kind =
          pair_kind(components[static_cast<size_t>(base)].type, components[static_cast<size_t>(target)].type);
      if (base == target || kind == PairKind::none || !base_first(components, base, target)) continue;
      pairs.add({base, target, kind});
    }
  }
  pairs.shrink_to_fit();
  return pairs;
}

}  // namespace takt
