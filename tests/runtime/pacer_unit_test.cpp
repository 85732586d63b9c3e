#include "server/runtime/pacer.h"
#include "tests/support/constants.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

/// Time passes only by sleeping, by a fixed lateness per wake-up, and by the test.
class FakeClock final : public MonotonicClock {
 public:
  std::int64_t now_ns() override { return now; }
  void sleep_until_ns(std::int64_t deadline_ns) override {
    if (deadline_ns > now) now = deadline_ns;
    now += lateness;
  }
  std::int64_t now = 1'000'000'000'000;
  std::int64_t lateness = 0;
};

class PacerTest : public testing::Test {
 protected:
  FakeClock clock_;
  Pacer pacer_{clock_};
  const std::int64_t begin_ = clock_.now;
};

TEST_F(PacerTest, StepsFollowAnAbsoluteSchedule) {
  pacer_.anchor(0.001, 1.0);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(pacer_.wait(test::kMillisecond_ns), Pacer::Result::due);
    EXPECT_EQ(clock_.now, begin_ + i * test::kMillisecond_ns);
    clock_.now += 300'000;  // computation
  }
  EXPECT_EQ(pacer_.figures().overruns, 0U);
}

TEST_F(PacerTest, LateWakeUpsDoNotAddUp) {
  clock_.lateness = 70'000;
  pacer_.anchor(0.001, 1.0);
  for (int i = 0; i < 1000; ++i) pacer_.wait(test::kMillisecond_ns);
  EXPECT_EQ(clock_.now, begin_ + 999 * test::kMillisecond_ns + 70'000);
  EXPECT_EQ(pacer_.figures().lag_ns, 70'000);
  EXPECT_EQ(pacer_.wakeup_latency().count(), 999U);
  EXPECT_NEAR(pacer_.wakeup_latency().quantile_s(0.5), 70e-6, 0.1 * 70e-6);
}

TEST_F(PacerTest, TheFactorScalesWallTime) {
  pacer_.anchor(0.001, 4.0);
  for (int i = 0; i < 401; ++i) pacer_.wait(test::kMillisecond_ns);
  EXPECT_EQ(clock_.now, begin_ + 100 * test::kMillisecond_ns);
}

TEST_F(PacerTest, AStepSizeThatIsNoWholeNanosecondDoesNotDrift) {
  pacer_.anchor(1.0 / 3000.0, 1.0);
  for (int i = 0; i < 3'000'001; ++i) pacer_.wait(test::kMillisecond_ns);
  EXPECT_EQ(clock_.now, begin_ + 1'000'000 * test::kMillisecond_ns);
}

TEST_F(PacerTest, LongSleepsAreCut) {
  pacer_.anchor(0.001, 0.01);  // a step every 100 ms
  EXPECT_EQ(pacer_.wait(10 * test::kMillisecond_ns), Pacer::Result::due);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(pacer_.wait(10 * test::kMillisecond_ns), Pacer::Result::not_due);
  EXPECT_EQ(pacer_.wait(10 * test::kMillisecond_ns), Pacer::Result::due);
  EXPECT_EQ(clock_.now, begin_ + 100 * test::kMillisecond_ns);
}

TEST_F(PacerTest, ASmallLagIsCaughtUpWithoutSkippingAStep) {
  pacer_.anchor(0.001, 1.0);
  pacer_.wait(test::kMillisecond_ns);
  clock_.now += 50 * test::kMillisecond_ns;  // steps 1 to 50 are due or overdue now
  int without_sleep = 0;
  while (clock_.now == begin_ + 50 * test::kMillisecond_ns) {
    EXPECT_EQ(pacer_.wait(test::kMillisecond_ns), Pacer::Result::due);
    if (clock_.now == begin_ + 50 * test::kMillisecond_ns) ++without_sleep;
  }
  EXPECT_EQ(without_sleep, 50);
  EXPECT_EQ(clock_.now, begin_ + 51 * test::kMillisecond_ns);
  EXPECT_EQ(pacer_.figures().overruns, 49U);  // the one due exactly now is not late
  EXPECT_EQ(pacer_.figures().max_consecutive_overruns, 49U);
  EXPECT_EQ(pacer_.figures().schedule_resets, 0U);
  EXPECT_EQ(pacer_.figures().lag_ns, 0);
}

TEST_F(PacerTest, TheDelayIsThatOfTheNextStep) {
  pacer_.anchor(0.001, 1.0);
  pacer_.wait(test::kMillisecond_ns);
  EXPECT_EQ(pacer_.behind_ns(), 0);
  clock_.now += 700'000;
  EXPECT_EQ(pacer_.behind_ns(), 0) << "the next one is due in 0.3 ms";
  clock_.now += 20 * test::kMillisecond_ns;  // a step of 20.7 ms
  EXPECT_EQ(pacer_.behind_ns(), 19'700'000);
  EXPECT_EQ(pacer_.figures().lag_ns, 0) << "the newest one began in time";
  pacer_.wait(test::kMillisecond_ns);
  EXPECT_EQ(pacer_.behind_ns(), 18'700'000);
}

TEST_F(PacerTest, ALargeLagMovesTheScheduleOnce) {
  pacer_.anchor(0.001, 1.0);
  pacer_.wait(test::kMillisecond_ns);
  clock_.now += 200 * test::kMillisecond_ns;
  EXPECT_EQ(pacer_.wait(test::kMillisecond_ns), Pacer::Result::schedule_reset);
  EXPECT_EQ(pacer_.figures().lag_ns, 199 * test::kMillisecond_ns);
  EXPECT_EQ(pacer_.wait(test::kMillisecond_ns), Pacer::Result::due);
  EXPECT_EQ(clock_.now, begin_ + 201 * test::kMillisecond_ns);
  EXPECT_EQ(pacer_.figures().schedule_resets, 1U);
  EXPECT_EQ(pacer_.figures().overruns, 1U);
}

}  // namespace
}  // namespace takt
