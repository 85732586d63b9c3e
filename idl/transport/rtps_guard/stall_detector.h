#pragma once
// Detects a thread that does not come back from Fast DDS. 2.9.1 has deadlocks that its later versions do not have, for
// example between the removal of a reader and the thread that repeats samples (Fast-DDS #3468): the participant then
// neither finds others nor is found, and cannot be deleted.
#include <atomic>
#include <cstdint>

namespace takt {

/// Of calls that take place one at a time. Time is counted in regular ticks: a process that is suspended does not stall.
class StallDetector {
 public:
  explicit StallDetector(int longest_ticks) : longest_ticks_(longest_ticks) {}

  /// In the thread that calls, around each call.
  void begin() { calls_.fetch_add(1, std::memory_order_relaxed); }
  void end() { calls_.fetch_add(1, std::memory_order_relaxed); }

  /// In another thread. True once for each call that lasts for more ticks than allowed.
  bool tick() {
    const std::uint64_t now = calls_.load(std::memory_order_relaxed);
    const bool in_same_call = now % 2 == 1 && now == seen_;
    seen_ = now;
    ticks_ = in_same_call ? ticks_ + 1 : 0;
    return ticks_ == longest_ticks_ + 1;
  }

 private:
  const int longest_ticks_;
  std::atomic<std::uint64_t> calls_{0};  ///< odd during a call
  std::uint64_t seen_ = 0;
  int ticks_ = 0;
};

}  // namespace takt
