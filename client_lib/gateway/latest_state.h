#pragma once
// The newest state of the cell for the threads of protocols, which never wait for a step.
//
// A thread of its own receives states and hands out the newest one. It also measures the wall time between two
// instants: a protocol with a cycle of its own has time limits that a cell must keep.
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "client_lib/client.h"

namespace takt::gateway {

class LatestState {
 public:
  /// Wall time between two instants of the cell that plays, s; over the last window of at least one second.
  struct Intervals {
    std::size_t count = 0;
    double p50_s = 0.0, p99_s = 0.0, max_s = 0.0;
  };

  /// Waits for the first state (ClientOptions::timeout); throws ClientError without one. `client` outlives this.
  /// `on_new` is called in this object's thread for each new instant, and must not wait.
  explicit LatestState(const Client& client, std::function<void(const State&)> on_new = {});
  ~LatestState();
  LatestState(const LatestState&) = delete;
  LatestState& operator=(const LatestState&) = delete;

  /// Never null. Any thread.
  std::shared_ptr<const State> get() const;
  Intervals intervals() const;

 private:
  void run();
  void receive();
  void measure(const State& state);

  const Client& client_;
  const std::function<void(const State&)> on_new_;
  mutable std::mutex mutex_;
  std::shared_ptr<const State> newest_;
  Intervals intervals_;
  // Of the window that is being measured; the thread's own.
  std::vector<double> window_s_;
  std::chrono::steady_clock::time_point window_begin_, previous_;
  std::uint64_t previous_step_ = 0;
  bool measuring_ = false;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

}  // namespace takt::gateway
