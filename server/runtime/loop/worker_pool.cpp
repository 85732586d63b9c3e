#include "server/runtime/loop/worker_pool.h"

#include <algorithm>

#include "server/runtime/loop/scheduling.h"
#include "server/runtime/monotonic_clock.h"

namespace takt {
namespace {

/// Polls (about 5 ns each) until a helper sleeps, and until the caller yields to helpers at work.
constexpr int kLooksBeforeSleep = 4000;
constexpr int kLooksBeforeYield = 2000;

void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

}  // namespace

WorkerPool::WorkerPool(int threads, int realtime_priority, Sharing sharing) : sharing_(sharing) {
  helpers_.reserve(static_cast<std::size_t>(threads > 1 ? threads - 1 : 0));
  try {
    for (int i = 1; i < threads; ++i)
      helpers_.emplace_back([this, realtime_priority] { help(realtime_priority); });
  } catch (...) {
    stop();
    throw;
  }
}

WorkerPool::~WorkerPool() {
  stop();
}

void WorkerPool::stop() {
  stop_.store(true);
  signal_.fetch_add(1);
  signal_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
  helpers_.clear();
}

bool WorkerPool::begin(std::uint64_t work) {
  if (sharing_ == Sharing::always) return true;
  if (helpers_.empty()) return false;
  const bool share = way_.choose() == 1;
  work_ = static_cast<double>(std::max<std::uint64_t>(work, 1));
  began_ns_ = monotonic_now_ns();
  return share;
}

void WorkerPool::end() {
  if (sharing_ == Sharing::always || helpers_.empty()) return;
  way_.note(static_cast<double>(monotonic_now_ns() - began_ns_) / work_);
}

bool WorkerPool::work_once() {
  std::size_t left = untaken_.load(std::memory_order_relaxed);
  do {
    if (left == 0) return false;
  } while (
      !untaken_.compare_exchange_weak(left, left - 1, std::memory_order_acquire, std::memory_order_relaxed));
  // Last: run() does not return until this task is done, so its data stay valid.
  task_(left - 1, context_);
  undone_.fetch_sub(1, std::memory_order_release);
  return true;
}

void WorkerPool::run(std::size_t count, Task task, void* context) {
  if (count == 0) return;
  task_ = task;
  context_ = context;
  undone_.store(count, std::memory_order_relaxed);
  // Sequentially consistent, as are the helpers' polls ahead of sleep: either a helper sees the tasks, or
  // this thread sees the sleeper.
  untaken_.store(count);
  if (sleepers_.load() > 0) {
    signal_.fetch_add(1);
    signal_.notify_all();
  }
  while (work_once()) {
  }
  for (int looks = 0; undone_.load(std::memory_order_acquire) != 0; ++looks) {
    if (looks < kLooksBeforeYield)
      relax();
    else
      std::this_thread::yield();  // a helper may be waiting for this very core
  }
}

void WorkerPool::help(int realtime_priority) {
  obtain_scheduling(realtime_priority);
  while (!stop_.load(std::memory_order_relaxed)) {
    for (int looks = 0; looks < kLooksBeforeSleep; ++looks) {
      if (work_once()) looks = 0;
      relax();
    }
    const std::uint32_t seen = signal_.load();
    sleepers_.fetch_add(1);
    if (untaken_.load() == 0 && !stop_.load()) signal_.wait(seen);
    sleepers_.fetch_sub(1);
  }
}

}  // namespace takt
