#pragma once
// Detects a process that was suspended (a debugger, SIGSTOP, a machine that stood still) for longer than its
// lease. Other participants have dropped it, but old packets in its sockets still announce them. The two
// sides of DDS would then disagree, and Fast DDS does not recover: of two participants that know each other's
// GUID the dropped one receives no samples (2.9.1; tests/python/test_frozen.py). So a resumed process drops
// all packets until its DDS has dropped the others too; then both discover each other again.
//
// It sends none either. An acknowledgement that was due when the process stopped would otherwise reach a participant that
// has just discovered it again: a writer of 2.9.1 removes what is acknowledged (ReaderProxy::acked_changes_set) and does not
// send it to the reader that asks for it later, which then never learns of some topics.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace takt {

/// Evaluates regular ticks of the process. Any thread; times in ns of one steady clock.
class SuspendDetector {
 public:
  /// Participants drop each other after a silence of `lease_ns`.
  SuspendDetector(std::int64_t lease_ns, std::int64_t now_ns) : lease_ns_(lease_ns), alive_ns_(now_ns) {}

  /// Due at least every tenth of the lease.
  void tick(std::int64_t now_ns) {
    (void)quarantined(now_ns);
    const bool regular = !overdue(now_ns);
    alive_ns_.store(now_ns);
    if (regular && ticks_to_come_.load() > 0) --ticks_to_come_;
  }
  /// Packets must be dropped. Also detects an overdue tick, because the call may come ahead of the first tick
  /// after a suspension.
  bool quarantined(std::int64_t now_ns) {
    if (overdue(now_ns)) {
      // This DDS received packets until at most one tick after the last one, and drops their senders a lease
      // later. The margin covers the threads that do it; it grows if ticks show that threads have to wait.
      const std::int64_t forgotten = alive_ns_.load() + lease_ns_ + lease_ns_ / 5;
      raise(quarantined_until_ns_, std::max(forgotten, now_ns + lease_ns_ / 5));
      raise(resumed_ns_, now_ns);
      ticks_to_come_.store(3);
    }
    return now_ns < quarantined_until_ns_.load() || ticks_to_come_.load() > 0;
  }
  /// Time at which the last such suspension was detected; 0: never.
  std::int64_t resumed_ns() const { return resumed_ns_.load(); }

 private:
  /// After a shorter suspension other participants still know this process, and both sides must act alike.
  bool overdue(std::int64_t now_ns) const { return now_ns - alive_ns_.load() > 11 * (lease_ns_ / 10); }
  static void raise(std::atomic<std::int64_t>& value, std::int64_t to) {
    std::int64_t present = value.load();
    while (present < to && !value.compare_exchange_weak(present, to)) {
    }
  }
  const std::int64_t lease_ns_;
  std::atomic<std::int64_t> alive_ns_, quarantined_until_ns_{0}, resumed_ns_{0};
  std::atomic<int> ticks_to_come_{0};  ///< until packets are accepted again
};

/// The same with a thread that generates the ticks.
class SuspendWatchdog {
 public:
  using Clock = std::chrono::steady_clock;
  explicit SuspendWatchdog(std::chrono::nanoseconds lease)
      : suspend_(lease.count(), now_ns()), thread_([this, period = lease / 10] { run(period); }) {}
  ~SuspendWatchdog() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    ended_.notify_all();
    thread_.join();
  }
  SuspendWatchdog(const SuspendWatchdog&) = delete;
  SuspendWatchdog& operator=(const SuspendWatchdog&) = delete;

  bool quarantined() { return suspend_.quarantined(now_ns()); }
  /// Time at which the last suspension longer than the lease was detected; the epoch: never.
  Clock::time_point returned() {
    (void)quarantined();
    return Clock::time_point(std::chrono::nanoseconds(suspend_.resumed_ns()));
  }

 private:
  static std::int64_t now_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
  }
  void run(std::chrono::nanoseconds period) {
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, period, [this] { return over_; })) suspend_.tick(now_ns());
  }

  SuspendDetector suspend_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace takt
