// Ownership of a target: by strength, by order of arrival, and across the two topics of a robot.
#include "server/dds/command_arbiter.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

constexpr int kSetPoints = 0, kTrajectories = 1;

CommandArbiter::Sender sender(std::uint64_t id, std::uint8_t participant, int topic, bool exclusive,
                              std::uint32_t strength = 1) {
  CommandArbiter::Sender s;
  s.id = id;
  s.exclusive = exclusive;
  s.strength = strength;
  s.topic = topic;
  s.identity[0] = participant;
  s.identity[15] = static_cast<std::uint8_t>(id);
  return s;
}

TEST(CommandArbiter, OneParticipantMayUseBothTopics) {
  for (const bool exclusive : {true, false}) {
    CommandArbiter arbiter;
    EXPECT_FALSE(arbiter.appeared(sender(1, 7, kSetPoints, exclusive)));
    EXPECT_FALSE(arbiter.appeared(sender(2, 7, kTrajectories, exclusive))) << "no rival of itself";
    EXPECT_TRUE(arbiter.offered(1, 0).heard);
    EXPECT_TRUE(arbiter.offered(2, 0).heard);
    EXPECT_TRUE(arbiter.offered(1, 0).heard);
    EXPECT_TRUE(arbiter.owns(1));
  }
}

TEST(CommandArbiter, SharedSendersDoNotInterleaveAcrossTopics) {
  CommandArbiter arbiter;
  arbiter.appeared(sender(1, 7, kSetPoints, false));
  arbiter.appeared(sender(2, 8, kTrajectories, false));
  EXPECT_TRUE(arbiter.offered(1, 0).heard);
  const auto refused = arbiter.offered(2, 1);
  EXPECT_FALSE(refused.heard);
  EXPECT_TRUE(refused.report);
  EXPECT_EQ(refused.owner, 1U);
  EXPECT_FALSE(arbiter.offered(2, 10).report) << "once a second";
  EXPECT_TRUE(arbiter.owns(1));
  EXPECT_FALSE(arbiter.owns(2));
  arbiter.vanished(1);
  EXPECT_TRUE(arbiter.offered(2, 20).heard);
  EXPECT_TRUE(arbiter.owns(2));
}

TEST(CommandArbiter, TheStrongerSenderIsHeardOnBothTopicsFromItsFirstSample) {
  CommandArbiter arbiter;
  arbiter.appeared(sender(1, 7, kSetPoints, true, 1));
  EXPECT_EQ(arbiter.appeared(sender(2, 8, kTrajectories, true, 5)), 1U) << "the loser";
  EXPECT_TRUE(arbiter.offered(1, 0).heard) << "the other has not sent anything";
  EXPECT_TRUE(arbiter.offered(2, 0).heard);
  const auto refused = arbiter.offered(1, 0);
  EXPECT_FALSE(refused.heard);
  EXPECT_EQ(refused.owner, 2U);
  arbiter.vanished(2);
  EXPECT_TRUE(arbiter.offered(1, 0).heard);
}

TEST(CommandArbiter, TheLowerIdentityIsHeardAmongEqualsOnBothTopics) {
  CommandArbiter arbiter;
  arbiter.appeared(sender(1, 9, kSetPoints, true));
  EXPECT_EQ(arbiter.appeared(sender(2, 8, kTrajectories, true)), 1U);
  EXPECT_TRUE(arbiter.offered(2, 0).heard);
  EXPECT_FALSE(arbiter.offered(1, 0).heard);
}

TEST(CommandArbiter, SendersForSeveralTargetsAreOrderedByTheArbiterAlone) {
  constexpr int kSeveral = CommandArbiter::kSeveral;
  CommandArbiter arbiter;
  arbiter.appeared(sender(1, 7, kSeveral, true, 1));
  EXPECT_TRUE(arbiter.offered(1, 0).heard);
  EXPECT_EQ(arbiter.appeared(sender(2, 8, kSeveral, true, 5)), 1U) << "the loser";
  EXPECT_TRUE(arbiter.offered(2, 0).heard) << "the stronger one";
  EXPECT_FALSE(arbiter.offered(1, 0).heard);
  EXPECT_FALSE(arbiter.appeared(sender(3, 8, kSetPoints, true, 5))) << "the same participant";
  EXPECT_TRUE(arbiter.offered(3, 0).heard);
  EXPECT_TRUE(arbiter.offered(2, 0).heard);
  arbiter.vanished(2);
  arbiter.vanished(3);
  EXPECT_TRUE(arbiter.offered(1, 0).heard);
}

}  // namespace
}  // namespace takt
