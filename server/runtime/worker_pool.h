#pragma once
// Threads that help one thread with short pieces of work (Executor): started once, nothing is allocated or
// locked per run.
//
// The caller works too, so a helper that the operating system does not let run delays nobody: it simply takes
// no task. Helpers look for work for some microseconds after a run, as the next one is often near, then
// sleep.
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "server/contact/executor.h"

namespace takt {

class WorkerPool final : public Executor {
 public:
  /// `threads` includes the caller: 1 starts none. Helpers ask for the scheduling of obtain_scheduling() with
  /// this priority, that of the thread that will call run(). Throws std::system_error when a thread cannot be
  /// started.
  explicit WorkerPool(int threads, int realtime_priority = 0);
  ~WorkerPool() override;
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  void run(std::size_t count, Task task, void* context) override;
  int threads() const { return static_cast<int>(helpers_.size()) + 1; }

 private:
  void help(int realtime_priority);
  bool work_once();
  void stop();

  // Written by run() while no task is left, read by whoever has taken one.
  Task task_ = nullptr;
  void* context_ = nullptr;
  alignas(64) std::atomic<std::size_t> untaken_{0};   ///< tasks nobody has taken yet; the last number first
  alignas(64) std::atomic<std::size_t> undone_{0};    ///< tasks not yet done
  alignas(64) std::atomic<std::uint32_t> signal_{0};  ///< what sleepers wait for a change of
  std::atomic<int> sleepers_{0};
  std::atomic<bool> stop_{false};
  std::vector<std::thread> helpers_;
};

}  // namespace takt
