#pragma once
// Periodically removes the shared memory of killed clients (transport/fastdds/stale_shm.h), on a thread of
// its own.
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "idl/transport/fastdds/stale_shm.h"

namespace takt {

class StaleShmReaper {
 public:
  StaleShmReaper() : thread_([this] { run(); }) {}
  ~StaleShmReaper() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    stopped_.notify_all();
    thread_.join();
  }
  StaleShmReaper(const StaleShmReaper&) = delete;
  StaleShmReaper& operator=(const StaleShmReaper&) = delete;

 private:
  void run() {
    constexpr std::chrono::seconds kEvery{20};
    std::unique_lock lock(mutex_);
    while (!stop_) {
      lock.unlock();
      (void)remove_stale_shared_memory();
      lock.lock();
      stopped_.wait_for(lock, kEvery, [this] { return stop_; });
    }
  }

  std::mutex mutex_;
  std::condition_variable stopped_;
  bool stop_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace takt
