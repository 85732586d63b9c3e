// Two participants of one process have the same number, and so the same GUID, as late as possible.
#include "client_lib/participant_numbers.h"

#include <gtest/gtest.h>

#include <set>

#include "client_lib/dds_link.h"
#include "tests/support/dds_service.h"
#include "tests/support/raw_dds_client.h"

namespace takt {
namespace {

using client::ParticipantNumbers;

TEST(ParticipantNumbers, NumbersReturnAsLateAsPossible) {
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

TEST(ParticipantNumbers, TwoProcessesDrawDifferentNumbers) {
  std::set<int> firsts;
  for (int i = 0; i < 100; ++i) firsts.insert(ParticipantNumbers().draw());
  EXPECT_GT(firsts.size(), 10U);
}

/// Fast DDS 2.9.1 would delete the other one.
TEST(ParticipantNumbers, NumbersOfOtherParticipantsAreNotTaken) {
  const int domain = static_cast<int>(test::test_domain());
  auto& numbers = ParticipantNumbers::of_process();
  std::vector<int> held;
  for (int number = numbers.draw(); number >= 0; number = numbers.draw()) held.push_back(number);
  ASSERT_FALSE(held.empty());
  test::RawDdsClient other(test::test_domain(), 2, held.back());
  numbers.give_back(held.back());  // the only one left
  {
    const client::Link link(domain, "beside", {});
    const auto participants = dds::DomainParticipantFactory::get_instance()->lookup_participants(
        static_cast<dds::DomainId_t>(domain));
    EXPECT_EQ(participants.size(), 2U);
  }
  EXPECT_EQ(dds::DomainParticipantFactory::get_instance()
                ->lookup_participants(static_cast<dds::DomainId_t>(domain))
                .size(),
            1U);
  held.pop_back();
  for (const int number : held) numbers.give_back(number);
}

}  // namespace
}  // namespace takt
