#pragma once
// Events on their way out that are no step's: from the host of the cell and from adapters, as text. Callbacks
// of DDS never write themselves (a callback must be short); the publishing thread numbers and writes
// everything in one order.
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/runtime/auto_reset_event.h"
#include "server/runtime/requests/event.h"

namespace takt {

struct DiagnosticEvent {
  Severity severity = Severity::warning;
  std::string code;
  std::string subject;
  std::string sender;
  std::string message;
};

class EventQueue {
 public:
  /// Beyond this many that wait, further ones are counted as lost.
  static constexpr std::size_t kCapacity = 10000;

  explicit EventQueue(AutoResetEvent& wakeup) : wakeup_(wakeup) {}

  /// Any thread.
  void post(DiagnosticEvent event) {
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.size() < kCapacity) {
        waiting_.push_back(std::move(event));
      } else {
        ++lost_;
      }
    }
    wakeup_.post();
  }

  struct Taken {
    std::vector<DiagnosticEvent> events;
    std::uint64_t lost = 0;
  };
  Taken take() {
    const std::lock_guard lock(mutex_);
    return {std::exchange(waiting_, {}), std::exchange(lost_, 0)};
  }

 private:
  AutoResetEvent& wakeup_;
  std::mutex mutex_;
  std::vector<DiagnosticEvent> waiting_;  // guarded by mutex_
  std::uint64_t lost_ = 0;                // guarded by mutex_
};

}  // namespace takt
