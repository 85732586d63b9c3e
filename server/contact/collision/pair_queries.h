#pragma once
// The pairs of one step whose convex shapes must be tested, and the tests, by one thread or several.
//
// Bits and counts do not depend on the number of threads: a verdict depends on shapes and poses alone, and a
// pair's hints are in a lane that it shares with the same pairs in the same order, whichever thread treats
// it. A task is one lane, so no two threads access the same hint.
#include <array>
#include <cstdint>
#include <vector>

#include "server/contact/collision/collision_world.h"
#include "server/contact/executor.h"

namespace takt {

class PairQueries {
 public:
  /// Number of calls (pairs of convex parts) below which the threads stay idle: dispatch takes microseconds,
  /// a call answered from a hint some 50 ns.
  static constexpr std::uint64_t kLeastCalls = 512;

  /// Room for this many pairs in a step; beyond it add() allocates.
  void reserve(std::size_t pairs) { items_.reserve(pairs); }
  /// nullptr: the calling thread does all work.
  void set_executor(Executor* executor, std::uint64_t least_calls);

  /// Begins a step with about this many expected calls. True: its pairs are added here, and run() updates
  /// their verdicts. False: the step is too small to share. In both cases end() follows.
  bool begin(std::uint64_t expected_calls);
  void end();
  struct Item {
    std::uint32_t pair, verdict;  ///< the pair's number, and the place of its verdict
    std::int32_t base, target;
    std::int32_t next = -1;  ///< of the same lane, or -1
  };
  /// Each pair at most once. `expected_calls`: those of its last test.
  void add(const Item& pair, std::uint64_t expected_calls);
  void run(CollisionWorld& world, std::vector<PairVerdict>& verdicts, DetectionCounts& counts);

  const std::vector<Item>& items() const { return items_; }  ///< in the order they were added

 private:
  static constexpr std::size_t kLanes = CollisionWorld::kHintLanes;
  struct alignas(64) Lane {  // a cache line each: written by different threads
    std::int32_t first = -1, last = -1;
    DetectionCounts counts;
  };
  struct Job {
    PairQueries& queries;
    CollisionWorld& world;
    std::vector<PairVerdict>& verdicts;
  };
  static void run_lane(std::size_t lane, void* job);

  void clear();
  bool enough(std::uint64_t calls) const { return executor_ != nullptr && calls >= least_calls_; }

  Executor* executor_ = nullptr;
  bool begun_ = false;  ///< begin() of the executor was called in this step
  std::uint64_t least_calls_ = kLeastCalls;
  std::vector<Item> items_;
  std::array<Lane, kLanes> lanes_;
  std::uint64_t expected_calls_ = 0;
};

}  // namespace takt
