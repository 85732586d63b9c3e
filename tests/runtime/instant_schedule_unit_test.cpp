// Which instants are due in lockstep: for observers by wall time, for recorders by simulated time.
#include "server/runtime/loop/instant_schedule.h"

#include <gtest/gtest.h>

#include <vector>

namespace takt {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// The steps of 1 ms at which an instant is due, while the wall clock stands.
std::vector<int> due_steps(InstantSchedule& schedule, int from, int to, std::int64_t now_ns) {
  std::vector<int> steps;
  for (int step = from; step <= to; ++step)
    if (schedule.due(1e-3 * step, now_ns)) steps.push_back(step);
  return steps;
}

TEST(InstantSchedule, ObserversGetAnInstantInEachHundredthOfASecond) {
  InstantSchedule schedule;
  schedule.published(0.0, kSecond_ns);
  EXPECT_FALSE(schedule.due(0.001, kSecond_ns + InstantSchedule::kObservers_ns - 1));
  EXPECT_TRUE(schedule.due(0.002, kSecond_ns + InstantSchedule::kObservers_ns));
}

TEST(InstantSchedule, ObserversGetAnInstantInEachTenthOfASecondOfSimulatedTime) {
  InstantSchedule schedule;
  schedule.restart(1.0);
  schedule.published(1.0, kSecond_ns);
  EXPECT_FALSE(schedule.due(1.099, kSecond_ns));
  EXPECT_TRUE(schedule.due(1.1, kSecond_ns));
  schedule.published(1.1, kSecond_ns);
  EXPECT_FALSE(schedule.due(1.199, kSecond_ns));
  EXPECT_TRUE(schedule.due(1.2, kSecond_ns));
}

TEST(InstantSchedule, RecordersGetThoseOfTheirPeriodFromItsOriginOn) {
  InstantSchedule schedule;
  schedule.published(0.0, kSecond_ns);
  schedule.watch({.period = 0.010, .origin = 0.003, .duration = 1.0}, 0.003, kSecond_ns);
  EXPECT_EQ(due_steps(schedule, 4, 40, kSecond_ns), (std::vector{13, 23, 33}));
  // Another one, with a period that is no multiple of the step: the first step after each.
  schedule.watch({.period = 0.0125, .origin = 0.0, .duration = 1.0}, 0.040, kSecond_ns);
  EXPECT_EQ(due_steps(schedule, 41, 80, kSecond_ns), (std::vector{43, 50, 53, 63, 73, 75}));
  // After a reset they begin again.
  schedule.restart(0.0);
  EXPECT_EQ(due_steps(schedule, 1, 14, kSecond_ns), (std::vector{3, 13}));
}

TEST(InstantSchedule, APeriodOfZeroIsEveryStepUntilTheWatchEnds) {
  InstantSchedule schedule;
  schedule.published(0.0, kSecond_ns);
  schedule.watch({.period = 0.0, .duration = 1e-3}, 0.0, kSecond_ns);
  EXPECT_EQ(due_steps(schedule, 1, 3, kSecond_ns), (std::vector{1, 2, 3}));
  EXPECT_EQ(due_steps(schedule, 4, 4, kSecond_ns + 1'000'000).size(), 1U) << "looked at as it ends";
  EXPECT_TRUE(due_steps(schedule, 5, 9, kSecond_ns + 1'000'001).empty());
}

TEST(InstantSchedule, TheNumberOfWatchesIsBounded) {
  InstantSchedule schedule;
  schedule.published(0.0, kSecond_ns);
  schedule.watch({.period = 0.0, .duration = 0.5}, 0.0, kSecond_ns);
  for (std::size_t i = 0; i < InstantSchedule::kMostWatches; ++i)
    schedule.watch({.period = 1.0, .duration = 1.0}, 0.0, kSecond_ns);
  EXPECT_TRUE(due_steps(schedule, 1, 99, kSecond_ns).empty()) << "the one that ends first made room";
}

}  // namespace
}  // namespace takt
