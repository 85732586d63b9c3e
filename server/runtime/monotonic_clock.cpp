#include "server/runtime/monotonic_clock.h"

#include <time.h>

#include <cerrno>

namespace takt {
namespace {

class SystemClock final : public MonotonicClock {
 public:
  std::int64_t now_ns() override { return monotonic_now_ns(); }
  void sleep_until_ns(std::int64_t deadline_ns) override {
    timespec deadline{};
    deadline.tv_sec = static_cast<time_t>(deadline_ns / 1'000'000'000);
    deadline.tv_nsec = static_cast<long>(deadline_ns % 1'000'000'000);
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
    }
  }
};

}  // namespace

std::int64_t monotonic_now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

MonotonicClock& system_monotonic_clock() {
  static SystemClock clock;
  return clock;
}

}  // namespace takt
