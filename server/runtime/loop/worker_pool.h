#pragma once
// Threads that help one thread with short tasks (Executor): started once, without allocation or lock per run.
// After a run helpers poll for a short time, because the next run is often near, then sleep.
//
// The caller works too, so a helper without a processor simply takes no task. A helper that is preempted
// during a task delays the run: on shared cores two threads may be slower than one. So the pool measures both
// ways of executing a stage and takes the faster one.
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "server/contact/executor.h"
#include "server/runtime/loop/adaptive_dispatch.h"

namespace takt {

class WorkerPool final : public Executor {
 public:
  enum class Sharing : std::uint8_t {
    when_faster,  ///< as measured
    always,       ///< for tests and measurements
  };
  /// `threads` includes the caller: 1 starts no helpers. Helpers request the scheduling of
  /// obtain_scheduling() with this priority, that of the thread that calls run(). Throws std::system_error if
  /// a thread cannot be started.
  explicit WorkerPool(int threads, int realtime_priority = 0, Sharing sharing = Sharing::when_faster);
  ~WorkerPool() override;
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  bool begin(std::uint64_t work) override;
  void end() override;
  void run(std::size_t count, Task task, void* context) override;
  int threads() const { return static_cast<int>(helpers_.size()) + 1; }

 private:
  void help(int realtime_priority);
  bool work_once();
  void stop();

  Sharing sharing_;
  AdaptiveDispatch way_;  ///< 0: the caller alone
  std::int64_t began_ns_ = 0;
  double work_ = 1.0;

  // Written by run() while no task is available, read by the thread that has taken one.
  Task task_ = nullptr;
  void* context_ = nullptr;
  alignas(64) std::atomic<std::size_t> untaken_{0};   ///< available tasks; the last number first
  alignas(64) std::atomic<std::size_t> undone_{0};    ///< tasks not yet done
  alignas(64) std::atomic<std::uint32_t> signal_{0};  ///< changes wake sleeping helpers
  std::atomic<int> sleepers_{0};
  std::atomic<bool> stop_{false};
  std::vector<std::thread> helpers_;
};

}  // namespace takt
