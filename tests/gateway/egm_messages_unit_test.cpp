// Messages of ABB's EGM, byte by byte.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client_lib/gateway/egm/messages.h"
#include "tests/support/egm_examples.h"

namespace takt::test::egm_messages {
namespace {

using namespace gateway::egm;
using testing::ElementsAre;
using testing::HasSubstr;

Motion golden_motion() {
  Motion motion;
  motion.joints = {0, -10, 20, 0, 30, 1.5};
  motion.pose = EgmPose{{1, 2, 3}, {1, 0, 0, 0}, std::array<double, 3>{0, 0, 0}};
  motion.time_us = 1700000000123456U;
  return motion;
}

Robot golden_robot() {
  Robot robot;
  robot.header = {0, static_cast<std::uint32_t>(1700000000123456U / 1000U & 0xffffffffU), MessageType::data};
  robot.feed_back = robot.planned = golden_motion();
  robot.motors = MotorState::on;
  robot.mci = MciState::running;
  robot.rapid = RapidState::running;
  robot.utilization = 12.5;
  return robot;
}

TEST(EgmMessages, TheGoldenMessagesAreWrittenByteByByte) {
  EXPECT_EQ(kGoldenEgmRobot.size(), 373U);
  EXPECT_EQ(encode(golden_robot()), kGoldenEgmRobot);
  EXPECT_EQ(kGoldenEgmSensor.size(), 66U);
  Sensor sensor;
  sensor.header = {0, 0, MessageType::correction};
  sensor.planned = Motion{{1, 2, 3, 4, 5, 6}, {}, {}, {}};
  EXPECT_EQ(encode(sensor), kGoldenEgmSensor);
}

TEST(EgmMessages, TheGoldenMessagesAreRead) {
  const auto robot = decode_robot(kGoldenEgmRobot);
  ASSERT_TRUE(robot.message) << robot.fault;
  EXPECT_EQ(robot.message->feed_back.joints, golden_motion().joints);
  EXPECT_EQ(robot.message->planned.joints, golden_motion().joints);
  EXPECT_EQ(robot.message->feed_back.time_us, 1700000000123456U);
  EXPECT_EQ(robot.message->motors, MotorState::on);
  EXPECT_EQ(robot.message->mci, MciState::running);
  EXPECT_EQ(robot.message->rapid, RapidState::running);
  EXPECT_FALSE(robot.message->converged);
  EXPECT_EQ(robot.message->utilization, 12.5);
  const auto sensor = decode_sensor(kGoldenEgmSensor);
  ASSERT_TRUE(sensor.message) << sensor.fault;
  EXPECT_THAT(sensor.message->planned->joints, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_FALSE(sensor.message->has_speeds);
}

TEST(EgmMessages, AHeaderWithoutTimeIsRead) {
  // The header of ABB's Python client: seqno 5, mtype 3, no tm.
  const auto sensor = decode_sensor(bytes_of_hex("0a0408051803") + kGoldenEgmSensor.substr(8));
  ASSERT_TRUE(sensor.message) << sensor.fault;
  EXPECT_EQ(sensor.message->header.seqno, 5U);
  EXPECT_FALSE(sensor.message->header.tm_ms);
  EXPECT_EQ(sensor.message->planned->joints.size(), 6U);
}

TEST(EgmMessages, PackedNumbersAreReadAndNeverWritten) {
  // Joints 1 and 2 as proto3 writes them. A reader of protocol buffers takes both forms; those of EGM are not packed.
  const auto packed =
      decode_sensor(bytes_of_hex("0a0408011803"
                                 "1214"
                                 "0a12"
                                 "0a10"
                                 "000000000000f03f0000000000000040"));
  ASSERT_TRUE(packed.message) << packed.fault;
  EXPECT_THAT(packed.message->planned->joints, ElementsAre(1, 2));
  Sensor sensor;
  sensor.planned = Motion{{1, 2}, {}, {}, {}};
  EXPECT_THAT(encode(sensor), HasSubstr(bytes_of_hex("0a1209000000000000f03f090000000000000040")));
}

TEST(EgmMessages, UnknownFieldsAreSkipped) {
  // Fields 14 (message), 90 (varint), 91 (eight bytes), 92 (four bytes), in front and behind.
  const std::string unknown = bytes_of_hex(
      "720b0a090900000000000000f0"
      "d00505"
      "d9050102030405060708"
      "e50501020304");
  const auto robot = decode_robot(unknown + kGoldenEgmRobot + unknown);
  ASSERT_TRUE(robot.message) << robot.fault;
  EXPECT_EQ(encode(*robot.message), kGoldenEgmRobot);
  // Force control of RobotWare 7: measuredForce has a flag in field 1 and forces in field 2.
  const auto force = decode_robot(kGoldenEgmRobot + bytes_of_hex("4a0b"
                                                                 "0801"
                                                                 "11000000000000f03f"));
  ASSERT_TRUE(force.message) << force.fault;
  EXPECT_THAT(force.message->force, ElementsAre(1.0));
  EXPECT_EQ(force.message->robotware, 7);
}

TEST(EgmMessages, TheMeasuredForceHasTheLayoutOfItsRobotWare) {
  Robot robot = golden_robot();
  robot.force = {1.0, 2.0};
  const std::string one = "000000000000f03f", two = "0000000000000040";
  EXPECT_THAT(encode(robot), HasSubstr(bytes_of_hex("4a12"
                                                    "09" +
                                                    one + "09" + two)));
  robot.robotware = 7;
  EXPECT_THAT(encode(robot), HasSubstr(bytes_of_hex("4a14"
                                                    "0801"
                                                    "11" +
                                                    one + "11" + two)));
  for (const int robotware : {6, 7}) {
    robot.robotware = robotware;
    const auto read = decode_robot(encode(robot));
    ASSERT_TRUE(read.message) << read.fault;
    EXPECT_THAT(read.message->force, ElementsAre(1.0, 2.0));
    EXPECT_EQ(read.message->robotware, robotware);
  }
}

TEST(EgmMessages, AMessageCutAtAnyByteIsNoneOrHasNothingThatIsNotInIt) {
  int whole = 0;
  for (std::size_t length = 0; length < kGoldenEgmSensor.size(); ++length) {
    const auto sensor = decode_sensor(std::string_view(kGoldenEgmSensor).substr(0, length));
    if (!sensor.message) {
      EXPECT_FALSE(sensor.fault.empty()) << length;
      continue;
    }
    ++whole;  // a message may end after any of its fields: here after the header
    EXPECT_EQ(length, 8U);
    EXPECT_FALSE(sensor.message->planned);
  }
  EXPECT_EQ(whole, 1);
  for (std::size_t length = 0; length < kGoldenEgmRobot.size(); ++length) {
    const auto robot = decode_robot(std::string_view(kGoldenEgmRobot).substr(0, length));
    if (!robot.message) continue;
    EXPECT_TRUE(robot.message->feed_back.joints.empty() || robot.message->feed_back.joints.size() == 6U)
        << length;
  }
}

/// Made by protoc --encode with the egm.proto of abb_libegm: EgmSensorPathCorr, seqno 7, mtype 4, pos (0, 5, -2.5), age 1.
TEST(EgmMessages, APathCorrectionIsThatOfAbbsDescriptor) {
  const std::string golden =
      bytes_of_hex("0a0408071804121f0a1b0900000000000000001100000000000014401900000000000004c01001");
  const auto read = decode_sensor(golden);
  ASSERT_TRUE(read.message) << read.fault;
  EXPECT_EQ(read.message->header.seqno, 7U);
  EXPECT_EQ(read.message->path_correction_mm, (std::array<double, 3>{0.0, 5.0, -2.5}));
  for (std::size_t length = 0; length + 1 < golden.size(); ++length)
    EXPECT_FALSE(decode_sensor(golden.substr(0, length)).message) << length;
}

TEST(EgmMessages, InvalidMessagesAreRefusedWithTheReason) {
  Sensor sensor;
  sensor.planned = golden_motion();
  EXPECT_TRUE(decode_sensor(encode(sensor)).message);
  sensor.header.type = MessageType::path_correction;
  EXPECT_THAT(decode_sensor(encode(sensor)).fault,
              HasSubstr("pathCorr.pos: found no whole vector; allowed: x, y, z"));
  sensor.header.type = MessageType::data;
  EXPECT_THAT(decode_sensor(encode(sensor)).fault, HasSubstr("mtype: found 2; allowed: 3"));
  EXPECT_THAT(decode_robot(kGoldenEgmSensor).fault, HasSubstr("mtype: found 3; allowed: 2"));
  EXPECT_THAT(decode_sensor("").fault, HasSubstr("empty"));
  EXPECT_THAT(decode_sensor(std::string(9000, '\x0a')).fault, HasSubstr("9000 bytes"));
  std::string nan = kGoldenEgmSensor;
  for (std::size_t i = 0; i < 8; ++i) nan[nan.size() - 8 + i] = '\xff';
  EXPECT_THAT(decode_sensor(nan).fault, HasSubstr("planned: found"));
  sensor.header.type = MessageType::correction;
  sensor.planned->joints.assign(65, 0.0);
  EXPECT_THAT(decode_sensor(encode(sensor)).fault, HasSubstr("65 numbers"));
  sensor.planned->joints.clear();
  sensor.planned->pose = EgmPose{{0, 0, 0}, {0, 0, 0, 0}, {}};
  EXPECT_THAT(decode_sensor(encode(sensor)).fault, HasSubstr("quaternion"));
}

TEST(EgmMessages, NumbersThatAreNotFiniteAreNeverSent) {
  Robot robot = golden_robot();
  robot.feed_back.joints[2] = std::nan("");
  robot.force = {INFINITY, 1.0};
  const auto read = decode_robot(encode(robot));
  ASSERT_TRUE(read.message) << read.fault;
  EXPECT_EQ(read.message->feed_back.joints[2], 0.0);
  EXPECT_THAT(read.message->force, ElementsAre(0.0, 1.0));
}

TEST(EgmMessages, AMessageThatIsCutAtAnyByteHasNoOtherValues) {
  // A message is a list of fields: one that is cut between two of them is one with fewer.
  const std::string bytes = kGoldenEgmRobot;
  const auto whole = decode_robot(bytes);
  ASSERT_TRUE(whole.message) << whole.fault;
  int refused = 0;
  for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
    const auto read = decode_robot(bytes.substr(0, cut));
    refused += read.message ? 0 : 1;
    if (!read.message) continue;
    const auto& joints = read.message->feed_back.joints;
    EXPECT_TRUE(joints == whole.message->feed_back.joints || joints == Robot{}.feed_back.joints) << cut;
  }
  EXPECT_GT(refused, static_cast<int>(bytes.size()) / 2);
}

TEST(EgmMessages, RandomChangesOfBytesNeverGiveANumberThatIsNotFinite) {
  std::mt19937 random(11);
  for (int round = 0; round < 50000; ++round) {
    std::string bytes = round % 2 == 0 ? kGoldenEgmSensor : kGoldenEgmRobot;
    for (auto changes = random() % 6 + 1; changes > 0; --changes)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    if (const auto sensor = decode_sensor(bytes); sensor.message && sensor.message->planned) {
      for (const double value : sensor.message->planned->joints) ASSERT_TRUE(std::isfinite(value));
    }
    if (const auto robot = decode_robot(bytes); robot.message) {
      for (const double value : robot.message->feed_back.joints) ASSERT_TRUE(std::isfinite(value));
    }
  }
}

}  // namespace
}  // namespace takt::test::egm_messages
