#pragma once
// The host's own thread: executes one request at a time and replies; during its work other requests are
// refused.
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "server/runtime/requests/control.h"
#include "server/runtime/requests/outbound_queue.h"

namespace takt {

class HostJobs {
 public:
  struct Job {
    std::uint64_t id = 0;
    requests::Any request;
  };

  /// `execute` is called by the thread; it may be called as soon as a job is offered.
  HostJobs(std::shared_ptr<OutboundQueue> outbound, std::function<ControlReply(const Job&)> execute)
      : outbound_(std::move(outbound)), execute_(std::move(execute)), thread_([this] { run(); }) {}
  ~HostJobs() { stop(); }
  HostJobs(const HostJobs&) = delete;
  HostJobs& operator=(const HostJobs&) = delete;

  // Any thread.

  /// Returns the name of the present work if the thread is busy; empty: the job is accepted, its reply
  /// follows.
  std::string offer(Job job) {
    {
      const std::lock_guard lock(mutex_);
      if (stop_) return "ending";
      if (!busy_with_.empty()) return busy_with_;
      busy_with_ = "working on " + control_request(job.request).request;
      job_ = std::move(job);
    }
    news_.notify_all();
    outbound_->news.post();
    return {};
  }
  /// The first scenario is loaded, or none was requested.
  void opened() {
    const std::lock_guard lock(mutex_);
    opened_ = true;
    busy_with_.clear();
  }
  /// True if the present job may load a scenario.
  bool loading() const {
    const std::lock_guard lock(mutex_);
    return !opened_ || (job_ && !std::holds_alternative<requests::UnloadScenario>(job_->request));
  }
  bool stopping() const {
    const std::lock_guard lock(mutex_);
    return stop_;
  }
  /// Starts no further job.
  void give_up() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    news_.notify_all();
  }
  /// As give_up(), and waits for the end of the present job.
  void stop() {
    give_up();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      news_.wait(lock, [&] { return stop_ || job_; });
      if (stop_) return;
      const Job job = *job_;
      lock.unlock();
      ControlReply reply = execute_(job);
      lock.lock();
      // Ahead of the reply: its receiver may send the next request.
      job_.reset();
      busy_with_.clear();
      outbound_->add_reply(std::move(reply));
    }
  }

  const std::shared_ptr<OutboundQueue> outbound_;
  const std::function<ControlReply(const Job&)> execute_;
  mutable std::mutex mutex_;
  std::condition_variable news_;
  std::optional<Job> job_;  // guarded by mutex_, as all below; waiting or being executed
  std::string busy_with_ = "loading its first scenario";  ///< for messages; empty: idle
  bool opened_ = false;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace takt
