// Places of the participants that DDS stores, and which of them give way.
#include "idl/transport/rtps_guard/participant_places.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

using Prefix = ParticipantPlaces::Prefix;
constexpr std::uint64_t kHere = 11, kThere = 12;

Prefix prefix(unsigned number) {
  return {1, static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 8U)};
}
/// As the guard does it: announced, stored by DDS.
bool come(ParticipantPlaces& places, unsigned number, std::uint32_t now_s, std::uint64_t address = kHere) {
  while (const auto one = places.overdue(now_s)) places.left(one->participant);
  const bool placed = places.announced(prefix(number), address, 1, now_s);
  if (placed) places.taken(prefix(number));
  return placed;
}

TEST(ParticipantPlaces, SilentOnesGiveWayToNewOnes) {
  ParticipantPlaces places;
  ASSERT_TRUE(come(places, 1, 100));
  places.answered(prefix(1));
  unsigned placed = 0;
  for (unsigned i = 0; i < 300; ++i) placed += come(places, 1000 + i, 101) ? 1U : 0U;
  EXPECT_LT(placed, ParticipantPlaces::kOfOneAddress) << "one address cannot take all";
  EXPECT_TRUE(come(places, 2, 101, kThere)) << "another address finds a place beside them";
  EXPECT_TRUE(come(places, 3, 101 + ParticipantPlaces::kHurry_s));
  EXPECT_LE(places.size(), ParticipantPlaces::kSilent + 3);
}

TEST(ParticipantPlaces, AnAnsweringParticipantKeepsItsPlace) {
  ParticipantPlaces places;
  for (unsigned i = 0; i < 100; ++i) {
    ASSERT_TRUE(come(places, i, 100));
    places.answered(prefix(i));
  }
  for (unsigned round = 0; round < 20; ++round)
    for (unsigned i = 0; i < 300; ++i) come(places, 1000 + 300 * round + i, 200 + 2 * round);
  while (const auto one = places.overdue(1000)) {
    for (unsigned i = 0; i < 100; ++i) EXPECT_NE(one->participant, prefix(i));
    places.left(one->participant);
  }
  EXPECT_EQ(places.size(), 100U);
}

TEST(ParticipantPlaces, AFewSilentOnesStayForHalfAMinute) {
  ParticipantPlaces places;
  ASSERT_TRUE(come(places, 1, 100));
  EXPECT_FALSE(places.overdue(100 + ParticipantPlaces::kAnswer_s - 1));
  const auto one = places.overdue(100 + ParticipantPlaces::kAnswer_s);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->participant, prefix(1));
  EXPECT_EQ(one->number, 2) << "beyond its announcements";
  EXPECT_FALSE(places.overdue(100 + ParticipantPlaces::kAnswer_s)) << "not twice at once";
  EXPECT_TRUE(places.overdue(100 + ParticipantPlaces::kAnswer_s + ParticipantPlaces::kHurry_s));
}

TEST(ParticipantPlaces, WhatDdsDidNotTakeGivesWayAtOnce) {
  ParticipantPlaces places;
  for (unsigned i = 0; i < 10 * ParticipantPlaces::kPlaces; ++i)
    EXPECT_TRUE(places.announced(prefix(i), kHere, 1, 100));
  EXPECT_LE(places.size(), ParticipantPlaces::kSilent);
}

TEST(ParticipantPlaces, AnsweringParticipantsDoNotGiveWay) {
  ParticipantPlaces places;
  for (unsigned i = 0; i < ParticipantPlaces::kPlaces; ++i) {
    ASSERT_TRUE(come(places, i, 100, 100 + i));
    places.answered(prefix(i));
  }
  EXPECT_FALSE(come(places, 5000, 100));
  places.left(prefix(7));
  EXPECT_TRUE(come(places, 5000, 100));
}

TEST(ParticipantPlaces, SharedMemoryIsNoAddress) {
  ParticipantPlaces places;
  for (unsigned i = 0; i < 200; ++i) {
    ASSERT_TRUE(come(places, i, 100, ParticipantPlaces::kNoAddress)) << i;
    places.answered(prefix(i));
  }
}

}  // namespace
}  // namespace takt
