#pragma once
// Output that belongs to no loaded scenario: replies to control requests, events as text, and the wake-up of
// the sending thread. Lives as long as the server; the loops of all scenarios share it.
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "server/runtime/auto_reset_event.h"
#include "server/runtime/monotonic_clock.h"
#include "server/runtime/requests/control.h"
#include "server/runtime/requests/event_queue.h"
#include "server/runtime/requests/instant_readers.h"

namespace takt {

class OutboundQueue {
 public:
  /// Posted for new output here or of the present loop.
  AutoResetEvent news;
  EventQueue events{news};
  /// Of the instants of all loops.
  InstantReaders instant_readers;
  /// Sent to every client that connects within the first seconds; see CellHost::announces().
  std::optional<DiagnosticEvent> announcement{};
  const std::int64_t began_ns = monotonic_now_ns();  ///< when the server began

  /// Any thread.
  void add_reply(ControlReply reply) {
    {
      const std::lock_guard lock(mutex_);
      replies_.push_back(std::move(reply));
    }
    news.post();
  }
  std::vector<ControlReply> take_replies() {
    const std::lock_guard lock(mutex_);
    return std::exchange(replies_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<ControlReply> replies_;  // guarded by mutex_
};

}  // namespace takt
