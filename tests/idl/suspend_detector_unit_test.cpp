#include "idl/transport/rtps_guard/suspend_detector.h"

#include <gtest/gtest.h>

#include <vector>

#include "idl/transport/rtps_guard/stale_participants.h"

namespace takt {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000, kLease = 5 * kSecond;

TEST(SuspendDetector, PacketsPassWithRegularTicks) {
  SuspendDetector suspend_detector(kLease, 100 * kSecond);
  for (std::int64_t t = 100 * kSecond; t < 160 * kSecond; t += kSecond / 2) {
    EXPECT_FALSE(suspend_detector.quarantined(t));
    suspend_detector.tick(t);
  }
  EXPECT_EQ(suspend_detector.resumed_ns(), 0);
}

TEST(SuspendDetector, AShortStopIsIgnored) {
  SuspendDetector suspend_detector(kLease, 10 * kSecond);
  EXPECT_FALSE(suspend_detector.quarantined(
      13 * kSecond));  // others drop it after 5 s, less the time between two announcements
  suspend_detector.tick(13 * kSecond);
  EXPECT_FALSE(suspend_detector.quarantined(13 * kSecond + 1));
  EXPECT_EQ(suspend_detector.resumed_ns(), 0);
}

/// Regular ticks from the time on, each half second, until anything comes in again; the time of that.
std::int64_t heard_again_ns(SuspendDetector& suspend_detector, std::int64_t from) {
  for (std::int64_t t = from; t < from + 20 * kSecond; t += kSecond / 100) {
    if ((t - from) % (kSecond / 2) == 0) suspend_detector.tick(t);
    if (!suspend_detector.quarantined(t)) return t;
  }
  return -1;
}

TEST(SuspendDetector, PacketsAreHeldBackAfterALongStop) {
  SuspendDetector suspend_detector(kLease, 10 * kSecond);
  EXPECT_TRUE(suspend_detector.quarantined(300 * kSecond));  // called ahead of the first tick
  EXPECT_EQ(suspend_detector.resumed_ns(), 300 * kSecond);
  EXPECT_EQ(heard_again_ns(suspend_detector, 300 * kSecond), 301 * kSecond + kSecond / 2);
  EXPECT_EQ(suspend_detector.resumed_ns(), 300 * kSecond);
}

TEST(SuspendDetector, TheTickDetectsAStop) {
  SuspendDetector suspend_detector(kLease, 10 * kSecond);
  EXPECT_EQ(heard_again_ns(suspend_detector, 30 * kSecond), 31 * kSecond + kSecond / 2);
  EXPECT_EQ(suspend_detector.resumed_ns(), 30 * kSecond);
}

/// With late ticks, the threads of DDS may be late too.
TEST(SuspendDetector, TheQuarantineLastsLongerWithLateTicks) {
  SuspendDetector suspend_detector(kLease, 10 * kSecond);
  suspend_detector.tick(30 * kSecond);
  for (const std::int64_t late : {32, 34, 36}) {
    EXPECT_TRUE(suspend_detector.quarantined(late * kSecond));
    suspend_detector.tick(late * kSecond);
  }
  EXPECT_FALSE(suspend_detector.quarantined(36 * kSecond));
}

/// While other participants may still know it, it must not drop them.
TEST(SuspendDetector, AStopShorterThanALeaseDropsNoPackets) {
  for (std::int64_t stop = 3 * kSecond; stop <= 5 * kSecond; stop += kSecond / 4) {
    int suspensions = 0;
    SuspendDetector suspend_detector(kLease, 10 * kSecond, [&] { ++suspensions; });
    EXPECT_EQ(heard_again_ns(suspend_detector, 10 * kSecond + stop), 10 * kSecond + stop);
    EXPECT_EQ(suspensions, 0);
    // Its last announcement lies up to 1 s before the stop, and the last tick half a second.
    EXPECT_EQ(suspend_detector.resumed_ns(), stop > 7 * kSecond / 2 ? 10 * kSecond + stop : 0);
  }
}

TEST(SuspendDetector, EachSuspensionIsReportedOnce) {
  int suspensions = 0;
  SuspendDetector suspend_detector(kLease, 10 * kSecond, [&] { ++suspensions; });
  for (const std::int64_t back : {20, 30, 40}) {
    EXPECT_TRUE(suspend_detector.quarantined(back * kSecond));
    EXPECT_TRUE(suspend_detector.quarantined(back * kSecond + 1));
    suspend_detector.tick(back * kSecond + 2);
    EXPECT_EQ(suspensions, back / 10 - 1);
  }
}

TEST(SuspendDetector, AStopJustOverALeaseLastsUntilBothSidesForget) {
  for (std::int64_t stop = 21 * kSecond / 4; stop <= 7 * kSecond; stop += kSecond / 4) {
    SuspendDetector suspend_detector(kLease, 10 * kSecond);
    const std::int64_t back = 10 * kSecond + stop;
    const std::int64_t heard = heard_again_ns(suspend_detector, back);
    // The last packet ahead of the stop arrived at most one tick after the last tick.
    EXPECT_GE(heard, 10 * kSecond + kSecond / 2 + kLease) << stop;
    EXPECT_LE(heard, back + 3 * kSecond / 2) << stop;
  }
}

StaleParticipants::Prefix prefix_of(std::uint8_t number) {
  return {1, 15, number};
}
std::vector<std::uint8_t> packet_of(std::uint8_t number) {
  std::vector<std::uint8_t> packet{'R', 'T', 'P', 'S', 2, 2, 1, 15};
  const auto prefix = prefix_of(number);
  packet.insert(packet.end(), prefix.begin(), prefix.end());
  return packet;
}

TEST(StaleParticipants, AreThoseFromBeforeASuspensionUntilDdsDropsThem) {
  StaleParticipants stale;
  stale.discovered(prefix_of(1));
  stale.discovered(prefix_of(2));
  EXPECT_FALSE(stale.sent(packet_of(1)));
  stale.suspended();
  stale.discovered(prefix_of(3));
  EXPECT_TRUE(stale.sent(packet_of(1)));
  EXPECT_TRUE(stale.sent(packet_of(2)));
  EXPECT_FALSE(stale.sent(packet_of(3)));
  stale.discovered(prefix_of(1));  // the same once more: DDS still has its old endpoints
  EXPECT_TRUE(stale.sent(packet_of(1)));
  stale.dropped(prefix_of(1));
  stale.discovered(prefix_of(1));
  EXPECT_FALSE(stale.sent(packet_of(1)));
  EXPECT_TRUE(stale.sent(packet_of(2)));
  EXPECT_FALSE(stale.sent(std::vector<std::uint8_t>(19)));  // too short for a sender
}

}  // namespace
}  // namespace takt
