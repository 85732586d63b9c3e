// A loop whose steps take longer than real time, on a clock that the test moves: the step size stays, no step
// is skipped, up to 50 ms of lag are caught up, more moves the schedule once, counted and reported, and the
// lag in the status is the true one.
#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "server/runtime/loop/run_loop.h"
#include "tests/support/constants.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

/// For the loop's thread alone. Time passes by sleeping, and by the duration of the steps.
class WorkClock final : public MonotonicClock {
 public:
  std::int64_t now_ns() override { return now; }
  void sleep_until_ns(std::int64_t deadline_ns) override { now = std::max(now, deadline_ns); }
  std::int64_t now = 1'000'000'000'000;
};

// Duration of a step. In every thousand steps: fifty of 1.8 ms, after which the loop is 40 ms behind, and
// much later one of 161 ms, after which it is 160 ms behind.
std::int64_t work_ns(std::uint64_t step) {
  const std::uint64_t place = step % 1000;
  if (place > 100 && place <= 150) return 1'800'000;
  if (place == 600) return 161 * test::kMillisecond_ns;
  return 200'000;
}

TEST(Overload, AnOverloadIsCaughtUpOrRebasedWithoutALostStep) {
  const auto model = test::service_model();
  Simulation simulation(model);
  WorkClock clock;
  std::mutex mutex;
  std::map<std::uint64_t, double> truth_s;  // by step: how far the clock is ahead of the schedule after it
  std::int64_t schedule_ns = clock.now;     // when step 0 was due, by the rules
  std::uint64_t next = 0, wrong_steps = 0, wrong_times = 0, moved = 0, late_when_calm = 0;
  RunLoopOptions options;
  options.clock = &clock;
  options.on_instant = [&](const Simulation& s) {
    const std::uint64_t step = s.step_index();
    wrong_steps += step != next++ ? 1U : 0U;
    wrong_times += s.time_s() != static_cast<double>(step) * 0.001 ? 1U : 0U;
    if (step == 0) return;
    // The step begins at its time or directly after the previous one.
    const std::int64_t behind =
        clock.now - (schedule_ns + static_cast<std::int64_t>(step - 1) * test::kMillisecond_ns);
    if (behind > 50 * test::kMillisecond_ns) {
      ++moved;
      schedule_ns += behind;
    }
    const std::uint64_t place = step % 1000;
    // Of 40 ms, 0.8 ms are caught up in each calm step; a moved schedule stays.
    if ((place <= 100 || (place > 250 && place < 600) || place > 700) && behind != 0) ++late_when_calm;
    clock.now += work_ns(step);
    const std::lock_guard lock(mutex);
    truth_s[step] = 1e-9 * static_cast<double>(clock.now - (schedule_ns + static_cast<std::int64_t>(step) *
                                                                              test::kMillisecond_ns));
  };
  RunLoop loop(simulation, options);
  test::LoopReader reader(loop);
  int compared = 0, behind = 0;
  std::uint64_t newest = 0;
  loop.start();
  ASSERT_TRUE(reader.wait_until([&] {
    if (!reader.status || reader.status->step == newest || reader.status->step == 0) return false;
    newest = reader.status->step;
    const std::lock_guard lock(mutex);
    const double truth = std::max(truth_s.at(newest), 0.0);
    EXPECT_NEAR(reader.status->lag_s, truth, 1e-3) << "at step " << newest;
    ++compared;
    behind += truth > 0.0 ? 1 : 0;
    return compared >= 10 && newest > 20'000;
  }));
  loop.stop();
  reader.read();
  EXPECT_EQ(wrong_steps, 0U);
  EXPECT_EQ(wrong_times, 0U);
  EXPECT_EQ(late_when_calm, 0U);
  const std::uint64_t steps = simulation.step_index();
  EXPECT_EQ(next, steps + 1);
  EXPECT_EQ(moved, (steps + 399) / 1000) << "once for each step of 161 ms, never for 40 ms";
  EXPECT_EQ(reader.status->schedule_resets, moved);
  std::size_t reported = 0;
  for (const EventRecord& event : reader.events) {
    const auto* reset = std::get_if<events::ScheduleReset>(&event.event);
    if (reset == nullptr) continue;
    ++reported;
    EXPECT_NEAR(reset->lag, 0.160, 1e-3) << describe(event, loop.cell()).message;
  }
  EXPECT_EQ(reported, moved);
}

}  // namespace
}  // namespace takt
