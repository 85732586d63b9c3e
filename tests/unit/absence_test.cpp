#include "idl/transport/absence.h"

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

TEST(Absence, AfterALongStopNothingComesInForAMoment) {
  Absence absence(kLease, 10 * kSecond);
  EXPECT_TRUE(absence.deaf(300 * kSecond));  // asked before the first tick
  EXPECT_EQ(absence.returned_ns(), 300 * kSecond);
  absence.tick(300 * kSecond + kSecond / 10);
  EXPECT_TRUE(absence.deaf(300 * kSecond + kSecond / 2));
  EXPECT_FALSE(absence.deaf(301 * kSecond + kSecond / 2));
}

TEST(Absence, TheTickItselfNoticesAStopToo) {
  Absence absence(kLease, 10 * kSecond);
  absence.tick(30 * kSecond);
  EXPECT_TRUE(absence.deaf(30 * kSecond + kSecond / 2));
  EXPECT_EQ(absence.returned_ns(), 30 * kSecond);
}

/// Others may have forgotten this process just before it would have forgotten them.
TEST(Absence, AStopOfAboutALeaseLastsUntilBothHaveForgotten) {
  for (std::int64_t stop = 4 * kSecond; stop <= 6 * kSecond; stop += kSecond / 4) {
    Absence absence(kLease, 10 * kSecond);
    const std::int64_t back = 10 * kSecond + stop;
    EXPECT_TRUE(absence.deaf(back));
    absence.tick(back);
    // The last that was heard before came at most one tick after the last one.
    EXPECT_TRUE(absence.deaf(10 * kSecond + kSecond / 2 + kLease)) << stop;
    EXPECT_FALSE(absence.deaf(std::max(back, 10 * kSecond + kLease) + kLease / 5)) << stop;
  }
}

}  // namespace
}  // namespace takt
