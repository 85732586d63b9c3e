#pragma once
// A pause of a std::jthread, whose end does not wait for the pause's.
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace takt {

/// False: the thread is to stop.
inline bool sleep_unless_stopped(const std::stop_token& stop, std::chrono::nanoseconds time) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  (void)never.wait_for(lock, stop, time, [] { return false; });
  return !stop.stop_requested();
}

}  // namespace takt
