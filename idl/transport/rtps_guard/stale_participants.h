#pragma once
// Participants that DDS knew when its process was suspended (suspend_detector.h) and has not dropped since.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <span>

namespace takt {

/// Any thread.
class StaleParticipants {
 public:
  using Prefix = std::array<std::uint8_t, 12>;  ///< GUID prefix

  void discovered(const Prefix& participant) {
    const std::lock_guard lock(mutex_);
    is_stale_.try_emplace(participant, false);
  }
  void dropped(const Prefix& participant) {
    const std::lock_guard lock(mutex_);
    is_stale_.erase(participant);
    count();
  }
  void suspended() {
    const std::lock_guard lock(mutex_);
    for (auto& [participant, stale] : is_stale_) stale = true;
    count();
  }
  /// Whether a stale participant has sent this RTPS packet.
  bool sent(std::span<const std::uint8_t> packet) const {
    constexpr std::size_t place = 8;  // after magic, version and vendor
    if (!any_.load(std::memory_order_relaxed) || packet.size() < place + Prefix{}.size()) return false;
    Prefix participant{};
    std::copy_n(packet.begin() + place, participant.size(), participant.begin());
    const std::lock_guard lock(mutex_);
    const auto found = is_stale_.find(participant);
    return found != is_stale_.end() && found->second;
  }

 private:
  void count() {
    any_.store(std::any_of(is_stale_.begin(), is_stale_.end(), [](const auto& one) { return one.second; }),
               std::memory_order_relaxed);
  }
  std::atomic<bool> any_{false};
  mutable std::mutex mutex_;
  std::map<Prefix, bool> is_stale_;  // guarded by mutex_
};

}  // namespace takt
