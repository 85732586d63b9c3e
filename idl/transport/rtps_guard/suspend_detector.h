#pragma once
// Detects a process that was suspended (a debugger, SIGSTOP, a machine that stood still) for so long that others have
// dropped it. Its own DDS may not have dropped them: old packets in its sockets announce them again, and a packet that
// was being processed counts as a sign of life. Fast DDS 2.9.1 does not recover from that: of two participants that know
// each other's GUID the dropped one receives no samples (tests/python/test_frozen.py). So a resumed process drops all
// packets for a moment, and those of each participant that it knew until its DDS has dropped that participant too
// (stale_participants.h); then both discover each other again.
//
// It sends none either. An acknowledgement that was due when the process stopped would otherwise reach a participant that
// has just discovered it again: a writer of 2.9.1 removes what is acknowledged (ReaderProxy::acked_changes_set) and does not
// send it to the reader that asks for it later, which then never learns of some topics.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>

#include "idl/transport/stoppable_sleep.h"

namespace takt {

/// Evaluates regular ticks of the process. Any thread; times in ns of one steady clock.
class SuspendDetector {
 public:
  /// Participants drop each other after a silence of `lease_ns`. `on_suspended` runs once for each suspension, in the
  /// thread that detects it.
  SuspendDetector(std::int64_t lease_ns, std::int64_t now_ns, std::function<void()> on_suspended = {})
      : lease_ns_(lease_ns), on_suspended_(std::move(on_suspended)), alive_ns_(now_ns) {}

  /// Due at least every tenth of the lease.
  void tick(std::int64_t now_ns) {
    (void)quarantined(now_ns);
    const bool regular = now_ns - alive_ns_.load() <= lease_ns_;
    alive_ns_.store(now_ns);
    if (regular && ticks_to_come_.load() > 0) --ticks_to_come_;
  }
  /// Packets must be dropped. Also detects an overdue tick, because the call may come ahead of the first tick
  /// after a suspension.
  bool quarantined(std::int64_t now_ns) {
    const std::int64_t alive_ns = alive_ns_.load(), silent_ns = now_ns - alive_ns;
    // Others have not heard it since its last announcement, a fifth of a lease before the last tick or later.
    if (silent_ns > 7 * (lease_ns_ / 10)) raise(resumed_ns_, now_ns);
    if (silent_ns > lease_ns_) {
      // This DDS received packets until at most one tick after the last one, and drops their senders a lease
      // later. The margin covers the threads that do it; it grows if ticks show that threads have to wait.
      const std::int64_t forgotten = alive_ns + lease_ns_ + lease_ns_ / 5;
      raise(quarantined_until_ns_, std::max(forgotten, now_ns + lease_ns_ / 5));
      ticks_to_come_.store(3);
      if (detected_ns_.exchange(alive_ns) != alive_ns && on_suspended_) on_suspended_();
    }
    return now_ns < quarantined_until_ns_.load() || ticks_to_come_.load() > 0;
  }
  /// Time at which the last suspension was detected after which others may have dropped this process; 0: never. They
  /// certainly have after a lease: only then are packets dropped.
  std::int64_t resumed_ns() const { return resumed_ns_.load(); }

 private:
  static void raise(std::atomic<std::int64_t>& value, std::int64_t to) {
    std::int64_t present = value.load();
    while (present < to && !value.compare_exchange_weak(present, to)) {
    }
  }
  const std::int64_t lease_ns_;
  const std::function<void()> on_suspended_;
  std::atomic<std::int64_t> alive_ns_, quarantined_until_ns_{0}, resumed_ns_{0};
  std::atomic<std::int64_t> detected_ns_{-1};  ///< last tick before the suspension that was detected last
  std::atomic<int> ticks_to_come_{0};          ///< until packets are accepted again
};

/// The same with a thread that generates the ticks, ten in a lease.
class SuspendWatchdog {
 public:
  using Clock = std::chrono::steady_clock;
  SuspendWatchdog(std::chrono::nanoseconds lease, std::function<void()> on_suspended,
                  std::function<void()> on_tick)
      : suspend_(lease.count(), now_ns(), std::move(on_suspended)),
        on_tick_(std::move(on_tick)),
        thread_([this, period = lease / 10](const std::stop_token& stop) {
          while (sleep_unless_stopped(stop, period)) {
            suspend_.tick(now_ns());
            on_tick_();
          }
        }) {}

  bool quarantined() { return suspend_.quarantined(now_ns()); }
  /// SuspendDetector::resumed_ns(); the epoch: never.
  Clock::time_point returned() {
    (void)quarantined();
    return Clock::time_point(std::chrono::nanoseconds(suspend_.resumed_ns()));
  }

 private:
  static std::int64_t now_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
  }

  SuspendDetector suspend_;
  const std::function<void()> on_tick_;
  std::jthread thread_;  // last: it uses the rest
};

}  // namespace takt
