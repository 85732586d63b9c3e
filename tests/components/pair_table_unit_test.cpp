// The compact table of pairs against a plain list.
#include "server/components/pair_table.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <utility>

namespace takt {
namespace {

TEST(PairTable, HasThePairsOfAPlainList) {
  std::mt19937 random(5);
  for (int run = 0; run < 50; ++run) {
    const int n = std::uniform_int_distribution<int>(1, 12)(random);
    std::set<std::pair<int, int>> list;
    for (int i = 0; i < 30; ++i) {
      const auto any = [&] { return std::uniform_int_distribution<int>(0, n - 1)(random); };
      const std::pair<int, int> pair{any(), any()};
      if (pair.first != pair.second) list.insert(pair);
    }
    PairTable table;
    for (const auto& [base, target] : list) table.add(base, target);
    ASSERT_EQ(table.size(), list.size());
    std::size_t number = 0;
    for (const auto& [base, target] : list) {
      EXPECT_EQ(table.base(number), base);
      EXPECT_EQ(table.target(number), target);
      EXPECT_EQ(table.find(base, target), number);
      EXPECT_GE(number, table.begin_of(base));
      EXPECT_LT(number, table.end_of(base));
      ++number;
    }
    for (int base = 0; base < n; ++base) {
      for (int target = 0; target < n; ++target) {
        const bool here = list.count({base, target}) != 0, there = list.count({target, base}) != 0;
        EXPECT_EQ(table.find(base, target) != PairTable::kNone, here);
        EXPECT_EQ(table.find_either(base, target) != PairTable::kNone, here || there);
      }
    }
  }
}

}  // namespace
}  // namespace takt
