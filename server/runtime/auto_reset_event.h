#pragma once
// Wakes one waiting thread. post() never blocks and allocates nothing, so that the step loop may call it;
// several posts before the wait are one.
#include <semaphore.h>
#include <time.h>

#include <atomic>
#include <cstdint>

namespace takt {

class AutoResetEvent {
 public:
  AutoResetEvent() { sem_init(&semaphore_, 0, 0); }
  ~AutoResetEvent() { sem_destroy(&semaphore_); }
  AutoResetEvent(const AutoResetEvent&) = delete;
  AutoResetEvent& operator=(const AutoResetEvent&) = delete;

  void post() {
    if (!posted_.exchange(true)) sem_post(&semaphore_);
  }

  bool is_posted() const { return posted_.load(); }

  /// Waits for a post until `deadline_ns` of CLOCK_MONOTONIC; true after a post. The caller must test the
  /// shared data after both results.
  bool wait_until_ns(std::int64_t deadline_ns) {
    timespec deadline{};
    deadline.tv_sec = static_cast<time_t>(deadline_ns / 1'000'000'000);
    deadline.tv_nsec = static_cast<long>(deadline_ns % 1'000'000'000);
    const bool woken = sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &deadline) == 0;
    if (woken) posted_.store(false);
    return woken;
  }

 private:
  sem_t semaphore_{};
  std::atomic<bool> posted_{false};
};

}  // namespace takt
