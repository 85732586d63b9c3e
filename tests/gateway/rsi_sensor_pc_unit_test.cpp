// The sensor PC's side of RSI without sockets: answers, time stamps, restarts, silence.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client_lib/gateway/rsi/sensor_pc.h"
#include "tests/support/rsi_examples.h"

namespace takt::test::rsi_sensor_pc {
namespace {

using namespace gateway::rsi;
using testing::HasSubstr;

std::string rob(std::uint64_t ipoc, double a1 = 0.0) {
  return with(with(kGoldenRob, "4208163634", std::to_string(ipoc)), "A1=\"0.0000\"",
              "A1=\"" + std::to_string(a1) + "\"");
}

TEST(SensorPc, EachPacketIsAnsweredWithItsOwnIpocAndTheNewestValues) {
  SensorPc pc(rsi_configuration(), {});
  pc.set(1, 0.572958);
  EXPECT_EQ(pc.receive(kGoldenRob, 0.0).answer, kGoldenSen);
  EXPECT_THAT(pc.receive(rob(4208163638), 0.004).answer, HasSubstr("<IPOC>4208163638</IPOC>"));
  SensorPc quiet(rsi_configuration(with(kRsiXml, "FALSE", "TRUE")), {});
  const Reception only = quiet.receive(kGoldenRob, 0.0);
  EXPECT_TRUE(only.answer.empty());
  EXPECT_TRUE(only.state);
}

TEST(SensorPc, TimesFollowIpocNotTheArrival) {
  SensorPc pc(rsi_configuration(), {});
  EXPECT_EQ(pc.receive(rob(1000), 50.0).time_s, 50.0);
  EXPECT_NEAR(pc.receive(rob(1004), 50.009).time_s, 50.004, 1e-9);
  EXPECT_NEAR(pc.receive(rob(1008), 50.0081).time_s, 50.008, 1e-9);
}

TEST(SensorPc, AControllerWhoseIpocIsNoMillisecondIsFollowedByItsArrivals) {
  SensorPc pc(rsi_configuration(), {});
  double last = 0.0;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const Reception r = pc.receive(rob(i), 0.04 * static_cast<double>(i));
    ASSERT_TRUE(r.state);
    EXPECT_EQ(r.restarted, i == 0);
    EXPECT_GE(r.time_s, last);
    EXPECT_NEAR(r.time_s, 0.04 * static_cast<double>(i), 0.1 + 1e-9);
    last = r.time_s;
  }
}

TEST(SensorPc, DoubledAndOvertakenPacketsAreAnsweredAndNotFollowed) {
  SensorPc pc(rsi_configuration(), {});
  pc.receive(rob(1000, 1.0), 0.0);
  pc.receive(rob(1008, 2.0), 0.008);
  for (const std::uint64_t ipoc : {1008U, 1004U}) {
    const Reception r = pc.receive(rob(ipoc, 9.0), 0.009);
    EXPECT_TRUE(r.old);
    EXPECT_FALSE(r.state);
    EXPECT_FALSE(r.restarted);
    EXPECT_THAT(r.answer, HasSubstr("<IPOC>" + std::to_string(ipoc)));
  }
  EXPECT_TRUE(pc.receive(rob(1012), 0.012).state);
}

TEST(SensorPc, AJumpOfIpocOrSilenceIsARestart) {
  SensorPc pc(rsi_configuration(), {});
  EXPECT_TRUE(pc.receive(rob(500000), 0.0).restarted);
  EXPECT_FALSE(pc.receive(rob(500004), 0.004).restarted);
  EXPECT_TRUE(pc.receive(rob(0), 0.008).restarted);
  EXPECT_TRUE(pc.receive(rob(2000), 0.012).restarted);
  EXPECT_FALSE(pc.silent(0.012 + 0.199));
  EXPECT_TRUE(pc.silent(0.012 + 0.201));
  EXPECT_TRUE(pc.receive(rob(2004), 0.3).restarted);
  EXPECT_EQ(pc.restarts(), 4U);
}

TEST(SensorPc, TheEmptyFirstFrameOfOldControllersIsIgnoredAndLaterRubbishIsReported) {
  SensorPc pc(rsi_configuration(), {});
  EXPECT_TRUE(pc.receive(std::string(40, '\0'), 0.0).fault.empty());
  EXPECT_EQ(pc.invalid(), 0U);
  pc.receive(kGoldenRob, 0.0);
  const Reception cut = pc.receive(kGoldenRob.substr(0, 200), 0.004);
  EXPECT_FALSE(cut.fault.empty());
  EXPECT_TRUE(cut.answer.empty());
  EXPECT_FALSE(cut.state);
  EXPECT_EQ(pc.invalid(), 1U);
}

}  // namespace
}  // namespace takt::test::rsi_sensor_pc
