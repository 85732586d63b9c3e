#pragma once
// The processes of bench_wire, and the memory that they share.
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <functional>
#include <new>
#include <stdexcept>
#include <vector>

#include "server/runtime/monotonic_clock.h"

namespace takt::wire {

struct Options {
  int domain = 0;
  std::vector<int> parts{10, 100, 1000};
  std::vector<double> rates_Hz{1000.0};
  std::vector<int> subscribers{1, 2, 4, 8, 16, 32};
  std::vector<int> cells{1, 2, 4, 8};
  int repetitions = 7;
  double seconds = 1.0;
  int realtime_priority = 0;
};

inline constexpr std::uint64_t kRing = 1U << 12U;
inline constexpr std::size_t kMostLatencies = 1U << 16U;

/// A publisher with its subscribers.
struct Pair {
  std::array<std::atomic<std::int64_t>, kRing> published_ns{};  ///< by step modulo kRing
  std::atomic<std::uint64_t> ticks{0}, missed{0};
  std::atomic<int> has_turn{0};
  std::atomic<std::size_t> count{0};  ///< of latencies, of the first subscriber
  std::array<std::int64_t, kMostLatencies> latency_ns{};
  std::array<std::atomic<std::uint64_t>, 64> received{};  ///< by subscriber
};

struct Shared {
  std::array<Pair, 4> pairs;
  std::atomic<std::uint64_t> idle_ticks{0}, idle_missed{0};  ///< of a loop that does nothing
  std::atomic<bool> over{false};
  std::atomic<int> ready{0};
  std::atomic<int> connected_us{0}, listed_us{0}, listed{0};
};

inline Shared* make_shared_memory() {
  void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  return new (memory) Shared;
}

inline void sleep_ms(int milliseconds) {
  system_monotonic_clock().sleep_until_ns(monotonic_now_ns() + 1'000'000LL * milliseconds);
}

class Processes {
 public:
  explicit Processes(Shared& shared) : shared_(shared) {}
  ~Processes() { end(); }
  pid_t start(const std::function<void()>& work) {
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      int result = 0;
      try {
        work();
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        result = 1;
      }
      std::fflush(nullptr);
      _exit(result);
    }
    children_.push_back(child);
    return child;
  }
  void wait_for_ready(int count) {
    while (shared_.ready.load() < count) {
      sleep_ms(10);
      if (waitpid(-1, nullptr, WNOHANG) > 0)
        throw std::runtime_error("A process of this benchmark has ended.");
    }
  }
  void end() {
    shared_.over.store(true);
    for (const pid_t child : children_) waitpid(child, nullptr, 0);
    children_.clear();
    shared_.over.store(false);
    shared_.ready.store(0);
  }

 private:
  Shared& shared_;
  std::vector<pid_t> children_;
};

inline double cpu_s(pid_t process) {
  clockid_t clock{};
  timespec used{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &used) != 0) return 0.0;
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace takt::wire
