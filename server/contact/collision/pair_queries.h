#pragma once
// The pairs of one step whose convex shapes must be looked at, and the looking, by one thread or several.
//
// Bits and counts do not depend on the number of threads: a verdict depends on shapes and poses alone, and a
// pair's hints live in a lane of their own that this pair shares with the same others in the same order
// whoever works on it. A task is a lane, so no two threads ever touch the same hint.
#include <array>
#include <cstdint>
#include <vector>

#include "server/components/pair_generation.h"
#include "server/contact/collision/collision_world.h"
#include "server/contact/executor.h"

namespace takt {

class PairQueries {
 public:
  /// Calls (pairs of convex parts) below which the threads are not woken: handing work over costs a few
  /// microseconds and a call answered from memory some 50 ns.
  static constexpr std::uint64_t kLeastCalls = 512;

  explicit PairQueries(std::size_t most_pairs) { items_.reserve(most_pairs); }
  /// nullptr: the calling thread does everything.
  void set_executor(Executor* executor, std::uint64_t least_calls);

  /// Begins a step in which about so many calls are to be expected. True: its pairs are to be added here, and
  /// run() brings their verdicts up to date. False: they are not worth it. Either way end() follows.
  bool begin(std::uint64_t expected_calls);
  void end();
  /// Each pair at most once. `expected_calls`: those of its last test. Does not allocate.
  void add(std::size_t pair, const ComponentPair& ends, std::uint64_t expected_calls);
  void run(CollisionWorld& world, const std::vector<ComponentPair>& pairs, std::vector<PairVerdict>& verdicts,
           DetectionCounts& counts);

  struct Item {
    std::uint32_t pair;
    std::int32_t next;  ///< of the same lane, or -1
  };
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
    const std::vector<ComponentPair>& pairs;
    std::vector<PairVerdict>& verdicts;
  };
  static void run_lane(std::size_t lane, void* job);

  void clear();
  bool enough(std::uint64_t calls) const { return executor_ != nullptr && calls >= least_calls_; }

  Executor* executor_ = nullptr;
  bool begun_ = false;  ///< the executor knows of this step
  std::uint64_t least_calls_ = kLeastCalls;
  std::vector<Item> items_;
  std::array<Lane, kLanes> lanes_;
  std::uint64_t expected_calls_ = 0;
};

}  // namespace takt
