#pragma once
// Where the step loop waits for input. In lockstep it receives the input meanwhile, through an adapter: commands then
// need no change from a thread that receives to the loop's.
#include <atomic>
#include <cstdint>
#include <functional>

#include "server/runtime/auto_reset_event.h"

namespace takt {

/// Receives input for the loop in the thread that calls it.
class InputReceiver {
 public:
  /// Until `ready` or `deadline_ns` of CLOCK_MONOTONIC; `ready` is asked after each input and each interrupt(). False, at
  /// once: not possible now.
  virtual bool receive_until_ns(std::int64_t deadline_ns, const std::function<bool()>& ready) = 0;
  /// Any thread; never blocks.
  virtual void interrupt() = 0;

 protected:
  ~InputReceiver() = default;
};

class LoopWakeup {
 public:
  /// nullptr: none. Ahead of the loop's start, or after its end.
  void receive_with(InputReceiver* receiver) { receiver_.store(receiver); }
  /// Any thread; as AutoResetEvent::post().
  void post() {
    event_.post();
    if (InputReceiver* receiver = receiver_.load()) receiver->interrupt();
  }
  /// The loop's thread: as AutoResetEvent::wait_until_ns(). `receives`: it receives input itself, where it can.
  void wait_until_ns(std::int64_t deadline_ns, bool receives) {
    InputReceiver* receiver = receives ? receiver_.load() : nullptr;
    const bool received =
        receiver != nullptr && receiver->receive_until_ns(deadline_ns, [this] { return event_.is_posted(); });
    event_.wait_until_ns(received ? 0 : deadline_ns);
  }

 private:
  AutoResetEvent event_;
  std::atomic<InputReceiver*> receiver_{nullptr};
};

}  // namespace takt
