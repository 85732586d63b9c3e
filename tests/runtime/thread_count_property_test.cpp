// The same bits and the same counts for other numbers of threads and other orders of the tasks.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "server/runtime/loop/adaptive_dispatch.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/contact_scene.h"
#include "tests/support/moving_crowd.h"
#include "tests/support/random_handling.h"
#include "tests/support/thrown_bricks.h"

namespace takt::test {
namespace {

constexpr std::uint64_t kShareAlways = 1;

/// One thread, every run in another order.
class Shuffler final : public Executor {
 public:
  bool begin(std::uint64_t) override { return (++stages & 7U) != 0; }  // occasionally alone
  void end() override {}
  void run(std::size_t count, Task task, void* context) override {
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::shuffle(order.begin(), order.end(), engine_);
    for (const std::size_t i : order) task(i, context);
    ++runs;
  }
  std::uint64_t runs = 0, stages = 0;

 private:
  std::mt19937 engine_{7};
};

void expect_same_counts(const SimulationStatistics& a, const SimulationStatistics& b,
                        const std::string& who) {
  EXPECT_EQ(a.steps, b.steps) << who;
  EXPECT_EQ(a.broad_phase_tests, b.broad_phase_tests) << who;
  EXPECT_EQ(a.mpr_calls, b.mpr_calls) << who;
  EXPECT_EQ(a.mpr_skipped, b.mpr_skipped) << who;
  EXPECT_EQ(a.partner_searches, b.partner_searches) << who;
  EXPECT_EQ(a.connection_changes, b.connection_changes) << who;
  EXPECT_EQ(a.derivative_evaluations, b.derivative_evaluations) << who;
  EXPECT_EQ(a.part_steps_skipped, b.part_steps_skipped) << who;
}

/// A run without helpers, and runs with 1, 2, 3, 5 threads and in shuffled order, step by step beside it.
struct SideBySide {
  explicit SideBySide(const std::shared_ptr<const CellModel>& model) : alone(model) {
    for (const int threads : {1, 2, 3, 5}) {
      pools.push_back(std::make_unique<WorkerPool>(threads, 0, WorkerPool::Sharing::always));
      add(model, pools.back().get(), std::to_string(threads) + " threads");
    }
    pools.push_back(std::make_unique<WorkerPool>(2));
    add(model, pools.back().get(), "2 threads when faster");
    add(model, &shuffler, "shuffled");
  }
  void add(const std::shared_ptr<const CellModel>& model, Executor* executor, const std::string& name) {
    others.push_back(std::make_unique<Simulation>(model));
    others.back()->set_executor(executor, kShareAlways);
    names.push_back(name);
  }
  void step(const std::vector<Command>& commands) {
    ASSERT_TRUE(alone.step(commands)) << alone.fault();
    for (std::size_t i = 0; i < others.size(); ++i) {
      ASSERT_TRUE(others[i]->step(commands));
      ASSERT_EQ(others[i]->state_hash(), alone.state_hash()) << names[i] << ", step " << alone.step_index();
    }
  }
  void expect_same() const {
    for (std::size_t i = 0; i < others.size(); ++i)
      expect_same_counts(others[i]->statistics(), alone.statistics(), names[i]);
  }

  std::vector<std::unique_ptr<WorkerPool>> pools;
  Shuffler shuffler;
  Simulation alone;
  std::vector<std::unique_ptr<Simulation>> others;
  std::vector<std::string> names;
};

TEST(ThreadCount, RandomAssembliesHaveTheSameBitsAndCounts) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomCellOptions options;
    options.seed = seed;
    options.parts = 30 + 10 * static_cast<int>(seed);
    options.grippers = 2 + static_cast<int>(seed % 3);
    const RandomCell cell(options);
    RandomHandling handling(cell, seed + 1000);
    SideBySide runs(cell.model());
    Snapshot now = runs.alone.make_snapshot();
    for (int i = 0; i < 2500; ++i) {
      runs.alone.read_snapshot(now);
      runs.step(handling.commands(now));
      if (HasFatalFailure()) return;
    }
    runs.expect_same();
    EXPECT_GT(handling.counts().picks, 0);
    EXPECT_GT(runs.shuffler.runs, 500U);
    EXPECT_GT(runs.alone.statistics().mpr_calls, 1000U);
  }
}

TEST(ThreadCount, DecomposedPartsThatAllMoveHaveTheSameBitsAndCounts) {
  for (const bool exact_sleeping : {true, false}) {
    MovingCrowd crowd(exact_sleeping ? 5 : 3, exact_sleeping);
    SideBySide runs(crowd.model());
    for (int i = 0; i < (exact_sleeping ? 1500 : 600); ++i) {
      runs.step(crowd.commands(runs.alone));
      if (HasFatalFailure()) return;
    }
    runs.expect_same();
    Snapshot end = runs.alone.make_snapshot();
    runs.alone.read_snapshot(end);
    EXPECT_EQ(end.components[static_cast<std::size_t>(crowd.tray())].state, PartState::grasped);
    EXPECT_GT(runs.shuffler.runs, 500U);
    for (const auto& run : runs.others) {  // again from the start, with the hints
      run->reset();
      run->step(crowd.commands(*run));
      EXPECT_EQ(run->statistics().steps, 0U + run->step_index());
    }
  }
}

TEST(ThreadCount, ContactsByFieldsHaveTheSameBits) {
  if constexpr (kMaxLevelOfDetail < 3) GTEST_SKIP() << "needs level of detail 3";
  for (const char* depth : {"distance_field", "pressure_field"}) {
    SCOPED_TRACE(depth);
    SideBySide runs(library_scene("two_layers", {"contact.parallel=true", "contact.cache_unmoved_pairs=false",
                                                 std::string("contact.defaults.depth=") + depth}));
    for (int i = 0; i < 100; ++i) {
      runs.step({});
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(runs.shuffler.runs, 50U);
    EXPECT_GT(runs.alone.contact_counts().elements, 1000U);
  }
}

TEST(ThreadCount, IslandsWithStepsOfTheirOwnHaveTheSameBits) {
  if constexpr (kMaxLevelOfDetail < 3) GTEST_SKIP() << "needs level of detail 3";
  for (const char* method : {"automatic", "rosenbrock"}) {
    SCOPED_TRACE(method);
    for (const auto& bricks : {Bricks::piles(), Bricks::pile(6)}) {
      SideBySide runs(Bricks().cell(bricks, std::string("step_s: 0.004, method: ") + method,
                                    ", parallel: true, cache_unmoved_pairs: false"));
      for (int i = 0; i < 40; ++i) {
        runs.step({});
        if (HasFatalFailure()) return;
      }
      runs.expect_same();
      EXPECT_GT(runs.shuffler.runs, 50U);
      EXPECT_GT(runs.alone.contact_counts().elements, 100U);
    }
  }
}

TEST(AdaptiveDispatch, TheFasterWayIsTakenAndAChangeIsNoticed) {
  std::mt19937 engine(3);
  const auto noise = [&engine] { return 0.9 + 0.2 * static_cast<double>(engine() % 1000) / 1000.0; };
  AdaptiveDispatch way;
  const auto share_of_1 = [&](double cost_0, double cost_1, int stages) {
    int chosen = 0;
    for (int i = 0; i < stages; ++i) {
      const int now = way.choose();
      chosen += now;
      way.note((now == 1 ? cost_1 : cost_0) * noise());
    }
    return static_cast<double>(chosen) / stages;
  };
  EXPECT_GT(share_of_1(1.0, 0.7, 5000), 0.9);
  share_of_1(1.0, 1.3, 5000);  // some stages until it is noticed
  EXPECT_LT(share_of_1(1.0, 1.3, 20000), 0.03);
  share_of_1(1.0, 0.6, 40000);
  EXPECT_GT(share_of_1(1.0, 0.6, 20000), 0.9);
}

TEST(WorkerPool, EveryTaskRunsOnceAndItsResultIsVisible) {
  for (const int threads : {1, 2, 3, 8}) {
    WorkerPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    struct Sums {
      std::vector<std::uint64_t> calls, values;
      std::uint64_t round = 0;
    } sums;
    sums.calls.resize(97);
    sums.values.resize(97);
    std::uint64_t expected = 0;
    for (std::uint64_t round = 1; round <= 3000; ++round) {
      sums.round = round;
      const std::size_t count = round % 98;
      pool.run(
          count,
          [](std::size_t i, void* context) {
            Sums& s = *static_cast<Sums*>(context);
            ++s.calls[i];
            s.values[i] += s.round;
          },
          &sums);
      expected += count * round;
      ASSERT_EQ(std::accumulate(sums.values.begin(), sums.values.end(), std::uint64_t{0}), expected);
    }
    for (std::size_t i = 0; i < sums.calls.size(); ++i) {
      std::uint64_t times = 0;
      for (std::uint64_t round = 1; round <= 3000; ++round) times += i < round % 98 ? 1 : 0;
      EXPECT_EQ(sums.calls[i], times) << i;
    }
  }
}

}  // namespace
}  // namespace takt::test
