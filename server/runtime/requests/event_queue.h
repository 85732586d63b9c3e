#pragma once
// Queue of the events that are not from a step: from the host of the cell and from adapters, as text. DDS
// callbacks only post (a callback must be short); the publishing thread numbers and writes all events in one
// order.
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

/// For events that name no part of a cell by an index. `cell`: name of the server.
template <EventType Type>
DiagnosticEvent diagnostic(const Type& event, const std::string& cell, std::string sender = {}) {
  CellDescription named;
  named.cell = cell;
  const EventInfo& info = event_info<Type>();
  EventText text = describe(event, named);
  return {info.severity, std::string(info.code), std::move(text.subject), std::move(sender),
          std::move(text.message)};
}

class EventQueue {
 public:
  /// Beyond this many that wait, further ones are counted as lost.
  static constexpr std::size_t kCapacity = 10000;

  explicit EventQueue(AutoResetEvent& wakeup) : wakeup_(wakeup) {}

  /// Subject of events about the server as a whole. Set it ahead of the first post.
  std::string cell{};

  /// Any thread. `sender`: identity of the sender of commands that caused it. Returns the sentence.
  template <EventType Type>
  std::string post(const Type& event, std::string sender = {}) {
    DiagnosticEvent text = diagnostic(event, cell, std::move(sender));
    std::string sentence = text.message;
    post(std::move(text));
    return sentence;
  }

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
