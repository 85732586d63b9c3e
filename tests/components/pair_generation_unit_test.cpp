#include "server/components/pair_generation.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

Component component(ComponentType type, int hierarchy = 0) {
  Component c;
  c.type = type;
  c.hierarchy = hierarchy;
  return c;
}

TEST(PairGeneration, PairsAreThoseOfFigure34) {
  using enum ComponentType;
  for (const ComponentType other : {part, gripper, ground}) {
    EXPECT_EQ(pair_kind(part, other), PairKind::hold);
    EXPECT_EQ(pair_kind(other, part), PairKind::hold);
  }
  EXPECT_EQ(pair_kind(gripper, gripper), PairKind::none);
  EXPECT_EQ(pair_kind(ground, ground), PairKind::none);
  EXPECT_EQ(pair_kind(gripper, ground), PairKind::report);
  EXPECT_EQ(pair_kind(ground, gripper), PairKind::report);
}

TEST(PairGeneration, EveryPairAppearsOnceWithTheRightBase) {
  using enum ComponentType;
  const std::vector<Component> components{component(ground), component(part, 4), component(gripper),
                                          component(part, 2), component(part, 4)};
  const ComponentPairs pairs = generate_pairs(components);
  // 10 pairs of 5 components, all of which can interact here.
  ASSERT_EQ(pairs.size(), 10U);
  int holds = 0;
  for (const ComponentPair& pair : pairs) {
    const Component& base = components[static_cast<std::size_t>(pair.base)];
    const Component& target = components[static_cast<std::size_t>(pair.target)];
    if (pair.kind == PairKind::report) {
      EXPECT_EQ(base.type, gripper);
      EXPECT_EQ(target.type, ground);
      continue;
    }
    ++holds;
    EXPECT_EQ(base.type, part);
    if (target.type == part) {
      EXPECT_LE(base.hierarchy, target.hierarchy);
      if (base.hierarchy == target.hierarchy) {
        EXPECT_LT(pair.base, pair.target);
      }
    }
  }
  EXPECT_EQ(holds, 9);
}

}  // namespace
}  // namespace takt
