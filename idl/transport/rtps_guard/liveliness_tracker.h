#pragma once
// Time of the last packet of each watched participant.
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <span>

namespace takt {

class LivelinessTracker {
 public:
  using Prefix = std::array<std::uint8_t, 12>;  ///< GUID prefix
  using Clock = std::chrono::steady_clock;

  /// Starts to watch a participant; the call counts as a packet.
  void watch(const Prefix& prefix) {
    const std::lock_guard lock(mutex_);
    watched_.try_emplace(prefix, Clock::now());
    any_.store(true, std::memory_order_relaxed);
  }
  void forget(const Prefix& prefix) {
    const std::lock_guard lock(mutex_);
    watched_.erase(prefix);
    any_.store(!watched_.empty(), std::memory_order_relaxed);
  }
  /// A well-formed RTPS packet has come.
  void note(std::span<const std::uint8_t> packet) {
    constexpr std::size_t place = 8;  // after magic, version and vendor
    if (!any_.load(std::memory_order_relaxed) || packet.size() < place + Prefix{}.size()) return;
    Prefix prefix{};
    for (std::size_t i = 0; i < prefix.size(); ++i) prefix[i] = packet[place + i];
    const std::lock_guard lock(mutex_);
    const auto found = watched_.find(prefix);
    if (found != watched_.end()) found->second = Clock::now();
  }
  /// How long it has been silent (s); 0 for one that is not watched.
  double time_since_last_packet_s(const Prefix& prefix) const {
    const std::lock_guard lock(mutex_);
    const auto found = watched_.find(prefix);
    if (found == watched_.end()) return 0.0;
    return std::chrono::duration<double>(Clock::now() - found->second).count();
  }

 private:
  std::atomic<bool> any_{false};
  mutable std::mutex mutex_;
  std::map<Prefix, Clock::time_point> watched_;  // guarded by mutex_
};

}  // namespace takt
