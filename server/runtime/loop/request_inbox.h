#pragma once
// Transfer of control requests and of visits to the thread of a step loop.
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "server/runtime/loop/loop_wakeup.h"
#include "server/runtime/requests/control.h"

namespace takt {

class RequestInbox {
 public:
  struct Request {
    std::uint64_t id = 0;
    requests::Any request;
  };
  using Visit = std::function<void()>;

  /// Any thread. False: the loop has ended.
  bool push(Request request) {
    const std::lock_guard lock(mutex_);
    if (state_ == State::closed) return false;
    requests_.push_back(std::move(request));
    waiting_.store(true, std::memory_order_release);
    return true;
  }
  /// Another thread, one at a time: returns when the loop has executed the visit. False: the loop is not
  /// running.
  bool visit(const Visit& visit, LoopWakeup& wakeup) {
    std::unique_lock lock(mutex_);
    if (state_ != State::open) return false;
    visit_ = &visit;
    waiting_.store(true, std::memory_order_release);
    wakeup.post();
    visited_.wait(lock, [&] { return visit_ == nullptr || state_ != State::open; });
    return std::exchange(visit_, nullptr) == nullptr;
  }

  // From here on: the loop's thread.

  /// Call it ahead of the loop's start: visits are accepted from then on.
  void open() {
    const std::lock_guard lock(mutex_);
    state_ = State::open;
  }
  /// Whether a request or a visit may be waiting. Without a lock.
  bool waiting() const { return waiting_.load(std::memory_order_acquire); }
  /// Executes the waiting visit, if any.
  void serve_visit() {
    const Visit* visit = nullptr;
    {
      const std::lock_guard lock(mutex_);
      visit = visit_;
    }
    if (visit == nullptr) return;
    (*visit)();
    {
      const std::lock_guard lock(mutex_);
      visit_ = nullptr;
    }
    visited_.notify_all();
  }
  /// In the order they came in.
  std::vector<Request> take() {
    const std::lock_guard lock(mutex_);
    waiting_.store(visit_ != nullptr, std::memory_order_relaxed);
    return std::exchange(requests_, {});
  }
  /// End of the loop: returns the remaining requests and accepts no more.
  std::vector<Request> close() {
    const std::lock_guard lock(mutex_);
    state_ = State::closed;
    visited_.notify_all();
    return std::exchange(requests_, {});
  }

 private:
  enum class State { prepared, open, closed };

  std::atomic<bool> waiting_{false};
  std::mutex mutex_;
  State state_ = State::prepared;  // guarded by mutex_, as all below
  std::vector<Request> requests_;
  const Visit* visit_ = nullptr;
  std::condition_variable visited_;
};

}  // namespace takt
