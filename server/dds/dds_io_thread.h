#pragma once
// The thread of the DDS interface: writes new samples, and does the periodic checks: leases of senders,
// dropped packets. The step loop waits for it only in lockstep, where no instant may be skipped.
#include <atomic>
#include <cstdint>
#include <thread>

#include "server/dds/command_subscriber.h"
#include "server/dds/guard_watch.h"
#include "server/dds/state_publisher.h"
#include "server/runtime/host/cell_host.h"

namespace takt {

class DdsIoThread {
 public:
  /// All outlive it; `guard` may be null. Starts the thread.
  DdsIoThread(CellHost& host, StatePublisher& publisher, CommandSubscriber& commands,
              const PacketGuard* guard)
      : host_(host), publisher_(publisher), commands_(commands), guard_(guard), thread_([this] { run(); }) {}
  ~DdsIoThread() { stop(); }
  DdsIoThread(const DdsIoThread&) = delete;
  DdsIoThread& operator=(const DdsIoThread&) = delete;

  /// Writes the remaining samples, then ends the thread. Stop the host first. May be called more than once.
  void stop() {
    stop_.store(true);
    host_.outbound().news.post();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run() {
    constexpr std::int64_t kLeases_ns = 50'000'000;
    std::int64_t leases_ns = 0;
    while (!stop_.load(std::memory_order_relaxed)) {
      host_.outbound().news.wait_until_ns(monotonic_now_ns() + publisher_.longest_sleep_ns());
      publisher_.write();  // first: an instant waits for nothing else
      const std::int64_t now = monotonic_now_ns();
      if (now - leases_ns >= kLeases_ns) {
        leases_ns = now;
        commands_.expire_liveliness_leases();
      }
      guard_watch_.look(guard_, now, host_.outbound().events);
    }
    publisher_.finish();
  }

  CellHost& host_;
  StatePublisher& publisher_;
  CommandSubscriber& commands_;
  const PacketGuard* guard_;
  GuardWatch guard_watch_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace takt
