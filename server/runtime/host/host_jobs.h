#pragma once
// The host's own thread: executes one request at a time and replies; while it works, others are refused.
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

  /// What the host is busy with instead, for people; empty: the job was taken, its reply follows.
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
  /// The first scenario is there, or nothing was to be loaded.
  void opened() {
    const std::lock_guard lock(mutex_);
    opened_ = true;
    busy_with_.clear();
  }
  /// A scenario may come of what is being done.
  bool loading() const {
    const std::lock_guard lock(mutex_);
    return !opened_ || (job_ && !std::holds_alternative<requests::UnloadScenario>(job_->request));
  }
  bool stopping() const {
    const std::lock_guard lock(mutex_);
    return stop_;
  }
  /// Nothing further is begun.
  void give_up() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    news_.notify_all();
  }
  /// As give_up(); what is being done is done to its end.
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
      // Before the reply is out: its receiver may ask for the next thing.
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
  std::string busy_with_ = "loading its first scenario";  ///< for people; empty: nothing
  bool opened_ = false;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace takt
