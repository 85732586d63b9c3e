#include "idl/transport/rtps_guard/suspend_detector.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000, kLease = 5 * kSecond;

TEST(Absence, WhoTicksHearsEverything) {
  Absence absence(kLease, 100 * kSecond);
  for (std::int64_t t = 100 * kSecond; t < 160 * kSecond; t += kSecond / 2) {
    EXPECT_FALSE(absence.deaf(t));
    absence.tick(t);
  }
  EXPECT_EQ(absence.returned_ns(), 0);
}

TEST(Absence, AShortStopIsNone) {
  Absence absence(kLease, 10 * kSecond);
  EXPECT_FALSE(
      absence.deaf(13 * kSecond));  // others forget after 5 s, less the time between two announcements
  absence.tick(13 * kSecond);
  EXPECT_FALSE(absence.deaf(13 * kSecond + 1));
  EXPECT_EQ(absence.returned_ns(), 0);
}

/// Regular ticks from the time on, each half second, until anything comes in again; the time of that.
std::int64_t heard_again_ns(Absence& absence, std::int64_t from) {
  for (std::int64_t t = from; t < from + 20 * kSecond; t += kSecond / 100) {
    if ((t - from) % (kSecond / 2) == 0) absence.tick(t);
    if (!absence.deaf(t)) return t;
  }
  return -1;
}

TEST(Absence, AfterALongStopNothingComesInForAMoment) {
  Absence absence(kLease, 10 * kSecond);
  EXPECT_TRUE(absence.deaf(300 * kSecond));  // asked before the first tick
  EXPECT_EQ(absence.returned_ns(), 300 * kSecond);
  EXPECT_EQ(heard_again_ns(absence, 300 * kSecond), 301 * kSecond + kSecond / 2);
  EXPECT_EQ(absence.returned_ns(), 300 * kSecond);
}

TEST(Absence, TheTickItselfNoticesAStopToo) {
  Absence absence(kLease, 10 * kSecond);
  EXPECT_EQ(heard_again_ns(absence, 30 * kSecond), 31 * kSecond + kSecond / 2);
  EXPECT_EQ(absence.returned_ns(), 30 * kSecond);
}

/// Where ticks are late, those threads may be too that forget.
TEST(Absence, OnAStarvedMachineItTakesLonger) {
  Absence absence(kLease, 10 * kSecond);
  absence.tick(30 * kSecond);
  for (const std::int64_t late : {32, 34, 36}) {
    EXPECT_TRUE(absence.deaf(late * kSecond));
    absence.tick(late * kSecond);
  }
  EXPECT_FALSE(absence.deaf(36 * kSecond));
}

/// While others still know it, it must not forget them.
TEST(Absence, AStopOfLessThanALeaseIsLetPass) {
  for (std::int64_t stop = 3 * kSecond; stop <= 5 * kSecond; stop += kSecond / 4) {
    Absence absence(kLease, 10 * kSecond);
    EXPECT_EQ(heard_again_ns(absence, 10 * kSecond + stop), 10 * kSecond + stop);
    EXPECT_EQ(absence.returned_ns(), 0);
  }
}

TEST(Absence, AStopOfALittleMoreLastsUntilBothHaveForgotten) {
  for (std::int64_t stop = 23 * kSecond / 4; stop <= 7 * kSecond; stop += kSecond / 4) {
    Absence absence(kLease, 10 * kSecond);
    const std::int64_t back = 10 * kSecond + stop;
    const std::int64_t heard = heard_again_ns(absence, back);
    // The last that was heard before came at most one tick after the last one.
    EXPECT_GE(heard, 10 * kSecond + kSecond / 2 + kLease) << stop;
    EXPECT_LE(heard, back + 3 * kSecond / 2) << stop;
  }
}

}  // namespace
}  // namespace takt
