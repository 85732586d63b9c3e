#pragma once
// How many readers the instants of a cell have: the loop hands over none without a reader.
#include <atomic>
#include <cstdint>

namespace takt {

/// Any thread.
class InstantReaders {
 public:
  /// An adapter that counts its readers calls it. Until then each instant counts as read.
  void begin_to_count() { counted_.store(true, std::memory_order_relaxed); }
  /// This many readers have come, or gone if negative.
  void change(int count) {
    count_.fetch_add(count);
    if (count > 0) arrivals_.fetch_add(1);
  }
  bool any() const {
    return !counted_.load(std::memory_order_relaxed) || count_.load(std::memory_order_relaxed) > 0;
  }
  /// Changes whenever a reader comes.
  std::uint64_t arrivals() const { return arrivals_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> counted_{false};
  std::atomic<int> count_{0};
  std::atomic<std::uint64_t> arrivals_{0};
};

}  // namespace takt
