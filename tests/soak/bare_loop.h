#pragma once
// The capability of the machine itself: an empty loop, on the same schedule and with the same scheduling as
// the server's, beside it. Ticks that it misses too are caused by the machine.
#include <algorithm>
#include <atomic>
#include <future>
#include <thread>

#include "server/runtime/loop/scheduling.h"
#include "server/runtime/monotonic_clock.h"
#include "server/runtime/pacer.h"

namespace takt::test {

class BareLoop {
 public:
  struct Figures {
    double missed_percent = 0.0, longest_lag_s = 0.0;
    std::uint64_t schedule_resets = 0;
  };

  explicit BareLoop(int realtime_priority)
      : figures_(std::async(std::launch::async, [this, realtime_priority] {
          (void)obtain_scheduling(realtime_priority);
          return run();
        })) {}
  ~BareLoop() { over_ = true; }
  BareLoop(const BareLoop&) = delete;
  BareLoop& operator=(const BareLoop&) = delete;

  /// Ends it.
  Figures figures() {
    over_ = true;
    return figures_.get();
  }

 private:
  Figures run() {
    Pacer pacer(system_monotonic_clock());
    pacer.anchor(1e-3, 1.0);
    std::uint64_t ticks = 0;
    std::int64_t longest_ns = 0;
    for (; !over_; ++ticks) {
      while (pacer.wait(1'000'000'000) == Pacer::Result::not_due) {
      }
      longest_ns = std::max(longest_ns, pacer.figures().lag_ns);
    }
    const auto& figures = pacer.figures();
    return {100.0 * static_cast<double>(figures.overruns) /
                static_cast<double>(std::max<std::uint64_t>(ticks, 1)),
            1e-9 * static_cast<double>(longest_ns), figures.schedule_resets};
  }

  std::atomic<bool> over_{false};
  std::future<Figures> figures_;  // last: it uses the rest
};

}  // namespace takt::test
