// The step path in steady state: commands in, a goal that is watched, a step, the snapshot out to a reader. It does not allocate,
// takes no lock, makes no system call except to wake the reader, never waits, and faults no page.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <mutex>

#include "server/runtime/loop/run_loop.h"
#include "tests/support/constants.h"
#include "tests/support/effort.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"
#include "tests/support/step_path_counts.h"

namespace takt {
namespace {

struct Counts {
  std::uint64_t steps = 0, allocations = 0, locks = 0, calls = 0, wakes = 0;
  std::int64_t page_faults = 0, waits = 0;
  std::uint64_t commands = 0, reports = 0;
  std::string listed;
};

/// A goal of the second robot, which stays where it is until long after the end of the test.
void append_goal(RunLoop& loop) {
  const RobotDescription& robot = loop.cell().robots[1];
  RawTrajectory raw;
  std::vector<double> positions;
  for (const JointModel& joint : robot.arm.joints) raw.names.push_back(joint.name);
  for (const double q : {0.0, -test::kQuarterTurn_rad, test::kQuarterTurn_rad, -test::kQuarterTurn_rad,
                         -test::kQuarterTurn_rad, 0.0})
    positions.push_back(q);
  raw.points.push_back({positions, {}, {}, {}, 1e6});
  const auto command = std::get<TrajectoryCommand>(validate(loop.cell(), 1, raw));
  auto goal = std::make_shared<MotionGoal>();
  goal->number = 1;
  goal->target = 1;
  goal->path = command.path;
  goal->path_tolerance.position.fill(1.0);
  EXPECT_FALSE(loop.append(command, goal));
}

/// Runs the loop freely, while commands come in and snapshots are fetched, and counts in its thread from
/// `warm` steps on.
Counts counted_run(const std::shared_ptr<const CellModel>& model, std::uint64_t warm, std::uint64_t end) {
  Simulation simulation(model);
  Counts counts;
  test::SystemCallCount calls;
  test::ThreadUsage before;
  RunLoopOptions options;
  options.pace = Pace::free;
  options.state = SimulationState::paused;
  options.on_instant = [&](const Simulation& now) {
    if (now.step_index() == warm) {
      test::allocations = test::locks = 0;
      before = test::thread_usage();
      calls.begin();
      test::counting = true;
    } else if (now.step_index() == end) {
      test::counting = false;
      calls.end();
      const test::ThreadUsage after = test::thread_usage();
      counts = {end - warm,
                test::allocations,
                test::locks,
                calls.others(),
                calls.wakes(),
                after.page_faults - before.page_faults,
                after.waits - before.waits,
                0,
                0,
                calls.listed()};
    }
  };
  RunLoop loop(simulation, options);
  test::LoopReader reader(loop);
  loop.start();
  append_goal(loop);
  reader.submit("set_state", {{"state", "playing"}});
  EXPECT_TRUE(reader.wait_until([&] {
    // Other requests than this are no part of a step.
    if (reader.snapshot && reader.snapshot->step > 0)
      (void)loop.append(test::swing(0, reader.snapshot->time_s), 1, monotonic_now_ns());
    return reader.snapshot && reader.snapshot->step >= end;
  }));
  loop.stop();
  GoalReport report;
  while (loop.output().goals.pop(report)) {
    EXPECT_EQ(report.end, GoalEnd::none);
    ++counts.reports;
  }
  Snapshot snapshot = simulation.make_snapshot();
  simulation.read_snapshot(snapshot);
  counts.commands = snapshot.robots[0].commands_applied;
  return counts;
}

TEST(StepPathCounts, AllocationsLocksCallsAndFaultsAreCounted) {
  if (!test::SystemCallCount::possible()) GTEST_SKIP() << "needs Linux 5.11 on x86-64";
  std::mutex mutex;
  test::SystemCallCount calls;
  test::allocations = test::locks = 0;
  calls.begin();
  test::counting = true;
  ::operator delete(::operator new(1));
  mutex.lock();
  mutex.unlock();
  syscall(SYS_getppid);
  syscall(SYS_getppid);
  test::counting = false;
  calls.end();
  syscall(SYS_getppid);
  EXPECT_EQ(test::allocations, 1U);
  EXPECT_EQ(test::locks, 1U);
  EXPECT_EQ(calls.others(), 2U) << calls.listed();
  const auto before = test::thread_usage();
  const std::size_t size = 1U << 22U;
  // From the system: memory of the heap may be touched already.
  void* const fresh = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(fresh, MAP_FAILED);
  for (std::size_t i = 0; i < size; i += 4096) static_cast<volatile char*>(fresh)[i] = 1;
  EXPECT_GT(test::thread_usage().page_faults - before.page_faults, 0);
  munmap(fresh, size);
}

TEST(StepPath, TheStepPathHasNoAllocationLockWaitOrPageFault) {
  if (!test::SystemCallCount::possible()) GTEST_SKIP() << "needs Linux 5.11 on x86-64";
  const std::uint64_t steps = 100'000 * test::effort();
  const Counts counts = counted_run(test::service_model(), 2000, 2000 + steps);
  ASSERT_EQ(counts.steps, steps);
  EXPECT_EQ(counts.allocations, 0U);
  EXPECT_EQ(counts.locks, 0U);
  EXPECT_EQ(counts.calls, 0U) << counts.listed;
  // The step causes no page fault; a machine that is short of memory may evict a page.
  EXPECT_LE(counts.page_faults, 10);
  EXPECT_LE(counts.waits, 10);
  EXPECT_GT(counts.wakes, 0U) << "no reader was woken";
  EXPECT_GT(counts.commands, 100U);
  EXPECT_GT(counts.reports, 100U) << "no goal was watched";
  RecordProperty("page_faults", std::to_string(counts.page_faults));
}

}  // namespace
}  // namespace takt
