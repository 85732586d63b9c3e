// Two participants of one process have the same number, and so the same GUID, as late as possible.
#include "client_lib/participant_numbers.h"

#include <gtest/gtest.h>

#include <set>

namespace takt {
namespace {

using client::ParticipantNumbers;

TEST(ParticipantNumbers, ComeAgainAsLateAsPossible) {
  ParticipantNumbers numbers;
  std::vector<int> order;
  for (int i = 0; i < ParticipantNumbers::kCount; ++i) {
    order.push_back(numbers.draw());
    numbers.give_back(order.back());
  }
  const std::set<int> different(order.begin(), order.end());
  EXPECT_EQ(different.size(), static_cast<std::size_t>(ParticipantNumbers::kCount));
  EXPECT_EQ(*different.begin(), ParticipantNumbers::kSmallest);
  EXPECT_EQ(*different.rbegin(), ParticipantNumbers::kSmallest + ParticipantNumbers::kCount - 1);
  for (const int before : order) EXPECT_EQ(numbers.draw(), before) << "the one that was given back first";
  EXPECT_EQ(numbers.draw(), -1) << "all are in use";
  numbers.give_back(-1);
  EXPECT_EQ(numbers.draw(), -1);
  numbers.give_back(order[7]);
  EXPECT_EQ(numbers.draw(), order[7]);
}

TEST(ParticipantNumbers, OfTwoProcessesAreDrawnByChance) {
  std::set<int> firsts;
  for (int i = 0; i < 100; ++i) firsts.insert(ParticipantNumbers().draw());
  EXPECT_GT(firsts.size(), 10U);
}

}  // namespace
}  // namespace takt
