#include "server/runtime/loop/command_buffer.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace takt {
namespace {

CellDescription two_robots_and_a_gripper() {
  CellDescription cell;
  cell.robots.resize(2);
  cell.robots[0].name = "Robot1";
  cell.robots[1].name = "Robot2";
  cell.grippers.resize(1);
  cell.grippers[0].name = "Gripper1";
  return cell;
}

Command joints(int robot, double stamp_s) {
  JointCommand command;
  command.robot = robot;
  command.stamp = SimTime::from_seconds(stamp_s);
  return command;
}

Command gripper(double stamp_s) {
  GripperCommand command;
  command.gripper = 0;
  command.stamp = SimTime::from_seconds(stamp_s);
  return command;
}

class CommandBufferTest : public testing::Test {
 protected:
  CellDescription cell_ = two_robots_and_a_gripper();
  CommandBuffer buffer_{cell_, 8};
  std::vector<ReceivedCommand> out_;
};

TEST_F(CommandBufferTest, CommandsAreHandedOverOnceInTheOrderOfArrival) {
  EXPECT_FALSE(buffer_.append(joints(1, -1.0), 7, 100));
  EXPECT_FALSE(buffer_.append(gripper(-1.0), 8, 200));
  buffer_.take_all(out_);
  ASSERT_EQ(out_.size(), 2U);
  EXPECT_EQ(std::get<JointCommand>(out_[0].command).robot, 1);
  EXPECT_EQ(out_[0].sender, 7U);
  EXPECT_EQ(out_[0].received_ns, 100);
  EXPECT_TRUE(std::holds_alternative<GripperCommand>(out_[1].command));
  buffer_.take_all(out_);
  EXPECT_TRUE(out_.empty());
}

TEST_F(CommandBufferTest, OnlyTheLastExpectedCommandWakesTheLoop) {
  const auto wakes = [&](const Command& command) {
    bool wake = false;
    EXPECT_FALSE(buffer_.append(command, 1, 0, &wake));
    return wake;
  };
  EXPECT_TRUE(wakes(joints(0, 1.0))) << "nothing is expected: the loop decides";
  buffer_.take_all(out_);
  buffer_.expect(SimTime::from_seconds(2.0), std::vector{0, 2});
  EXPECT_FALSE(wakes(joints(0, 2.0)));
  EXPECT_TRUE(wakes(joints(0, 2.0))) << "it has come already";
  EXPECT_TRUE(wakes(joints(1, 2.0))) << "of a target that is not expected";
  EXPECT_TRUE(wakes(gripper(1.5))) << "with another stamp: an error to be reported";
  EXPECT_TRUE(wakes(gripper(2.0)));
  buffer_.take_all(out_);
  EXPECT_EQ(out_.size(), 5U);
  buffer_.expect(SimTime::from_seconds(3.0), std::vector{0, 1});
  EXPECT_FALSE(wakes(joints(0, 3.0)));
  buffer_.take_all(out_);
  EXPECT_TRUE(wakes(joints(1, 3.0))) << "the loop has looked in between";
}

TEST_F(CommandBufferTest, CommandsOlderThanTheNewestOfTheirTargetAreRejected) {
  buffer_.set_present(SimTime::from_seconds(5.0));
  EXPECT_FALSE(buffer_.append(joints(0, 2.0), 1, 0));
  EXPECT_FALSE(buffer_.append(joints(0, 2.0), 1, 0)) << "the same stamp again replaces";
  const auto rejection = buffer_.append(joints(0, 1.999), 1, 0);
  ASSERT_TRUE(rejection);
  EXPECT_EQ(rejection->code, RejectionCode::stale);
  EXPECT_EQ(rejection->subject, "Robot1");
  EXPECT_NE(rejection->message.find("1.999000000 s"), std::string::npos) << rejection->message;
  EXPECT_NE(rejection->message.find("2.000000000 s"), std::string::npos) << rejection->message;
  EXPECT_FALSE(buffer_.append(joints(1, 1.0), 1, 0)) << "each robot for itself";
  EXPECT_FALSE(buffer_.append(gripper(1.0), 1, 0));
  EXPECT_FALSE(buffer_.append(joints(0, -1.0), 1, 0)) << "without a stamp there is nothing to compare";
  buffer_.take_all(out_);
  EXPECT_EQ(out_.size(), 5U);
}

TEST_F(CommandBufferTest, StampsAreComparedToTheNanosecond) {
  EXPECT_EQ(SimTime::from_seconds(0.008).ns, 8'000'000);
  EXPECT_EQ(SimTime::from_seconds(12345.000000001).ns, 12'345'000'000'001);
  EXPECT_EQ(SimTime::from_seconds(-1.0).ns, -1);
  buffer_.set_present(SimTime::from_seconds(5.0));
  EXPECT_FALSE(buffer_.append(joints(0, 1.000000001), 1, 0));
  EXPECT_TRUE(buffer_.append(joints(0, 1.0), 1, 0));
}

TEST_F(CommandBufferTest, AForeignClockDoesNotLockTheTargetForever) {
  buffer_.set_present(SimTime::from_seconds(3.0));
  EXPECT_FALSE(buffer_.append(joints(0, 1.7e9), 1, 0));
  EXPECT_FALSE(buffer_.append(joints(0, 3.0), 1, 0)) << "stamped with the present";
  EXPECT_TRUE(buffer_.append(joints(0, 2.0), 1, 0));
}

TEST_F(CommandBufferTest, FutureStampsAreOrderedAmongThemselves) {
  EXPECT_FALSE(buffer_.append(joints(0, 1.0), 1, 0));
  const auto rejection = buffer_.append(joints(0, 0.5), 1, 0);
  ASSERT_TRUE(rejection);
  EXPECT_EQ(rejection->code, RejectionCode::stale);
}

TEST_F(CommandBufferTest, AStampFarAheadIsOutvotedByTwoThatFollow) {
  buffer_.set_present(SimTime::from_seconds(3.0));
  EXPECT_FALSE(buffer_.append(joints(0, 3.1), 1, 0));
  EXPECT_FALSE(buffer_.append(joints(0, 5000.0), 1, 0)) << "forged, or a foreign clock";
  EXPECT_TRUE(buffer_.append(joints(0, 3.2), 1, 0)) << "a single one may be late";
  EXPECT_FALSE(buffer_.append(joints(0, 3.3), 1, 0));
  EXPECT_FALSE(buffer_.append(joints(0, 3.4), 1, 0));
  EXPECT_TRUE(buffer_.append(joints(0, 3.35), 1, 0)) << "from here on in order again";
}

TEST_F(CommandBufferTest, StampsThatGoBackDoNotOutvoteOneAhead) {
  buffer_.set_present(SimTime::from_seconds(3.0));
  EXPECT_FALSE(buffer_.append(joints(0, 5.0), 1, 0));
  EXPECT_TRUE(buffer_.append(joints(0, 4.5), 1, 0));
  EXPECT_TRUE(buffer_.append(joints(0, 4.4), 1, 0));
  EXPECT_FALSE(buffer_.append(joints(0, 5.1), 1, 0));
  EXPECT_TRUE(buffer_.append(joints(0, 4.6), 1, 0)) << "the first of a new series";
}

// As a controller repeats its answers ahead, when an instant that it answered comes once more: the loop decides on them.
TEST_F(CommandBufferTest, RepeatsAreNotStaleInLockstep) {
  const CellDescription cell = two_robots_and_a_gripper();
  CommandBuffer buffer(cell);
  buffer.set_lockstep(true);
  const auto send = [&](double present_s) {
    buffer.set_present(SimTime::from_seconds(present_s));
    for (std::uint64_t k = 0; k < kMostLookahead; ++k)
      EXPECT_FALSE(buffer.append(joints(0, 1.0 + 0.008 * static_cast<double>(k)), 1, 0)) << k;
    buffer.take_all(out_);
    EXPECT_EQ(out_.size(), kMostLookahead);
  };
  for (const double present_s : {1.0, 1.0, 1.1, 2.0}) send(present_s);
  EXPECT_TRUE(buffer.append(joints(0, 1.004), 1, 0)) << "was never accepted";
  EXPECT_TRUE(buffer.append(joints(0, 0.992), 1, 0));
  buffer.set_lockstep(false);
  EXPECT_TRUE(buffer.append(joints(0, 1.0), 1, 0));
  buffer.set_lockstep(true);
  EXPECT_FALSE(buffer.append(joints(0, 1.0), 2, 0));
  EXPECT_FALSE(buffer.append(joints(0, 1.5), 2, 0));
  EXPECT_TRUE(buffer.append(joints(0, 1.008), 2, 0)) << "the first sender's stamps are not the second one's";
}

TEST_F(CommandBufferTest, AnotherSenderStartsItsOwnOrder) {
  buffer_.set_present(SimTime::from_seconds(9.0));
  EXPECT_FALSE(buffer_.append(joints(0, 8.0), 1, 0));
  EXPECT_FALSE(buffer_.append(joints(0, 7.0), 2, 0));
  EXPECT_TRUE(buffer_.append(joints(0, 6.0), 2, 0));
}

TEST_F(CommandBufferTest, AnOverflowIsRejectedAndReported) {
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(buffer_.append(joints(0, -1.0), 1, 0));
  const auto rejection = buffer_.append(joints(0, -1.0), 1, 0);
  ASSERT_TRUE(rejection);
  EXPECT_NE(rejection->message.find("8 commands already wait"), std::string::npos) << rejection->message;
  buffer_.take_all(out_);
  EXPECT_EQ(out_.size(), 8U);
  EXPECT_FALSE(buffer_.append(joints(0, -1.0), 1, 0));
}

TEST_F(CommandBufferTest, AResetClearsTheOrderOfStamps) {
  buffer_.set_present(SimTime::from_seconds(9.0));
  EXPECT_FALSE(buffer_.append(joints(0, 8.0), 1, 0));
  buffer_.forget();
  buffer_.take_all(out_);
  EXPECT_TRUE(out_.empty());
  EXPECT_FALSE(buffer_.append(joints(0, 0.0), 1, 0));
}

TEST(CommandBuffer, NoCommandIsLostBetweenThreads) {
  const CellDescription cell = two_robots_and_a_gripper();
  CommandBuffer buffer(cell);
  constexpr int kEach = 20000;
  const auto produce = [&](int robot) {
    for (int i = 0; i < kEach;) {
      JointCommand command;
      command.robot = robot;
      command.position[0] = i;
      if (!buffer.append(command, 1, i)) ++i;  // full: the consumer is behind, try again
    }
  };
  std::thread first(produce, 0), second(produce, 1);
  std::vector<ReceivedCommand> out;
  std::vector<int> next{0, 0};
  while (next[0] < kEach || next[1] < kEach) {
    buffer.take_all(out);
    for (const auto& received : out) {
      const auto& command = std::get<JointCommand>(received.command);
      int& expected = next[static_cast<std::size_t>(command.robot)];
      ASSERT_EQ(command.position[0], expected);
      ++expected;
    }
  }
  first.join();
  second.join();
  buffer.take_all(out);
  EXPECT_TRUE(out.empty());
}

}  // namespace
}  // namespace takt
