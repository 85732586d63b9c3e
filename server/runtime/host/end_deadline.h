#pragma once
// Ends a process that does not end by itself: its last threads wait for a library that does not return.
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace takt {

/// From construction to destruction at most `longest` passes: then `sentence` goes to stderr, and the process ends with
/// `code`, without destructors.
class EndDeadline {
 public:
  EndDeadline(std::chrono::milliseconds longest, std::string sentence, int code)
      : sentence_(std::move(sentence)), code_(code), thread_([this, longest] { run(longest); }) {}
  ~EndDeadline() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    ended_.notify_all();
    thread_.join();
  }
  EndDeadline(const EndDeadline&) = delete;
  EndDeadline& operator=(const EndDeadline&) = delete;

 private:
  void run(std::chrono::milliseconds longest) {
    std::unique_lock lock(mutex_);
    if (ended_.wait_for(lock, longest, [this] { return over_; })) return;
    std::fprintf(stderr, "%s\n", sentence_.c_str());
    std::fflush(nullptr);
    ::_exit(code_);
  }

  const std::string sentence_;
  const int code_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;   // guarded by mutex_
  std::thread thread_;  // last: it uses the rest
};

}  // namespace takt
