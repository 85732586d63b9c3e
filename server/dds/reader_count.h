#pragma once
// The matched readers of a writer, without a question to DDS.
#include <atomic>
#include <functional>
#include <mutex>
#include <utility>

#include "idl/transport/fastdds/fastdds.h"

namespace takt {

/// Listener of a writer; outlives it.
class ReaderCount final : public dds::DataWriterListener {
 public:
  /// Called in threads of DDS with each change of the number.
  using OnChange = std::function<void(int change)>;
  explicit ReaderCount(OnChange on_change = {}) : on_change_(std::move(on_change)) {}

  bool any() const { return present() > 0; }
  int present() const { return count_.load(std::memory_order_relaxed); }
  /// The number of readers that have come so far.
  int arrivals() const { return arrivals_.load(std::memory_order_relaxed); }

  /// Changes are summed up: two threads of DDS may report theirs in either order.
  void on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& status) override {
    const std::lock_guard lock(mutex_);
    if (retired_) return;
    const int change = status.current_count_change;
    if (change > 0) arrivals_.fetch_add(change);
    add(change);
  }
  /// The writer goes: DDS does not report the end of its matches. Its readers have gone, and none comes.
  void retire() {
    const std::lock_guard lock(mutex_);
    retired_ = true;
    add(-present());
  }

 private:
  void add(int change) {
    count_.fetch_add(change);
    if (on_change_) on_change_(change);
  }

  const OnChange on_change_;
  std::mutex mutex_;
  bool retired_ = false;  // guarded by mutex_
  std::atomic<int> count_{0}, arrivals_{0};
};

}  // namespace takt
