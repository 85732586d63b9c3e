// Sets that are joined pairwise, against labels that are rewritten at each join.
#include "idl/common/disjoint_sets.h"

#include <gtest/gtest.h>

#include <random>

namespace takt {
namespace {

TEST(DisjointSets, TheRootIsTheLowestMember) {
  std::mt19937 dice(5);
  constexpr int kCount = 40;
  DisjointSets sets(kCount);
  for (int round = 0; round < 50; ++round) {
    sets.reset();
    std::vector<int> label(kCount);
    std::iota(label.begin(), label.end(), 0);
    for (int joins = 0; joins < kCount; ++joins) {
      const int a = static_cast<int>(dice() % kCount), b = static_cast<int>(dice() % kCount);
      sets.join(a, b);
      const int low = std::min(label[static_cast<std::size_t>(a)], label[static_cast<std::size_t>(b)]),
                high = std::max(label[static_cast<std::size_t>(a)], label[static_cast<std::size_t>(b)]);
      std::replace(label.begin(), label.end(), high, low);
      for (std::size_t i = 0; i < label.size(); ++i)
        ASSERT_EQ(sets.root(i), static_cast<std::size_t>(label[i]));
    }
  }
}

}  // namespace
}  // namespace takt
