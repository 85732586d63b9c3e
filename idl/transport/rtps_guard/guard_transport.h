#pragma once
// The guard in front of the transports of a participant: every packet from UDP or shared memory is inspected
// (rtps_guard.h) ahead of Fast DDS. Packets with a flaw are dropped and counted.
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "idl/transport/fastdds/fastdds.h"
#include "idl/transport/fastdds/udp_receiver.h"
#include "idl/transport/rtps_guard/liveliness_tracker.h"
#include "idl/transport/rtps_guard/rtps_fragments.h"
#include "idl/transport/rtps_guard/rtps_guard.h"
#include "idl/transport/rtps_guard/rtps_packet_memory.h"
#include "idl/transport/rtps_guard/stale_participants.h"
#include "idl/transport/rtps_guard/stall_detector.h"
#include "idl/transport/rtps_guard/suspend_detector.h"

namespace takt {

/// State and counts of the guard of one participant. Any thread.
class PacketGuard : public std::enable_shared_from_this<PacketGuard> {
 public:
  /// `lease`: silence after which participants drop each other; std::nullopt: never.
  PacketGuard(const GuardLimits& limits, std::optional<std::chrono::nanoseconds> lease)
      : limits_(limits), fragments_(limits.largest_sample_bytes, limits.most_fragments_joined) {
    if (lease)
      suspend_.emplace(
          *lease, [this] { stale_.suspended(); }, [this] { tick(); });
  }

  /// `on_stalled` runs in a thread of the guard when Fast DDS has kept a packet of discovery for two leases: it does not
  /// give it back. Set it ahead of the participant's construction.
  void set_on_stalled(std::function<void()> on_stalled) {
    const std::lock_guard lock(stalled_mutex_);
    on_stalled_ = std::move(on_stalled);
  }

  /// Follows the participants that DDS knows and drops. Call it ahead of the participant's construction; the
  /// listener keeps the guard alive.
  void follow(DiscoveryListener& listener);

  /// The participant has been made. It announces itself a moment before it receives (2.9.1, RTPSParticipantImpl::enable):
  /// answers from this machine would be lost, and the next announcements come after a second. So packets wait until this
  /// call, for half a second at most.
  void begin() {
    const std::lock_guard lock(begin_mutex_);
    begun_ = true;
    begun_changed_.notify_all();
  }
  void wait_for_begin() {
    if (begun_) return;
    constexpr std::chrono::milliseconds longest{500};
    std::unique_lock lock(begin_mutex_);
    if (!begun_changed_.wait_for(lock, longest, [this] { return begun_.load(); })) begun_ = true;
  }

  const GuardLimits& limits() const { return limits_; }
  RtpsSessionState& memory() { return memory_; }
  /// Held while a packet of discovery is inspected and passes through Fast DDS. Its threads, one per port and
  /// transport, would otherwise pass two at a time: one would use an endpoint that the other removes, and the
  /// stored state would contradict the announcements (an assertion of 2.9.1 then ends the process). Locked
  /// ahead of all locks of DDS, never while one is held.
  class Discovery {
   public:
    explicit Discovery(PacketGuard& guard) : guard_(guard), lock_(guard.discovery_) { guard_.stall_.begin(); }
    ~Discovery() { guard_.stall_.end(); }
    Discovery(const Discovery&) = delete;
    Discovery& operator=(const Discovery&) = delete;

   private:
    PacketGuard& guard_;
    const std::lock_guard<std::mutex> lock_;
  };
  FragmentAssembly& fragments() { return fragments_; }
  /// Of the packets with samples, from this machine. Closed with transports of a profile.
  UdpReceiver& receiver() { return receiver_; }
  LivelinessTracker& heard() const { return heard_; }
  /// Whether a reader of this participant is known to have answered a heartbeat of this own writer. Encrypted answers
  /// cannot be seen: true.
  bool is_synchronised(const rtps::GuidPrefix_t& participant, const rtps::EntityId_t& writer) const;
  /// The process was suspended for long: packets are neither received nor sent for a moment (suspend_detector.h).
  bool quarantined() { return suspend_ && suspend_->quarantined(); }
  /// Packets of these participants are dropped.
  const StaleParticipants& stale() const { return stale_; }
  /// When that was noticed last; the clock's epoch: never.
  SuspendWatchdog::Clock::time_point returned() {
    return suspend_ ? suspend_->returned() : SuspendWatchdog::Clock::time_point{};
  }
  void count(RtpsError flaw) {
    counts_[static_cast<std::size_t>(flaw)].fetch_add(1, std::memory_order_relaxed);
  }

  /// Number of packets with this flaw; `none`: number of accepted packets.
  std::uint64_t counted(RtpsError flaw) const {
    return counts_[static_cast<std::size_t>(flaw)].load(std::memory_order_relaxed);
  }
  /// Dropped as malformed. Encrypted packets that this participant cannot read are not among them.
  std::uint64_t dropped() const;
  /// "3 identity, 1 locator", or empty.
  std::string summary() const;

 private:
  void follow(const rtps::GuidPrefix_t& participant, DiscoveryListener::Presence presence);
  void tick() {
    if (!stall_.tick()) return;
    const std::lock_guard lock(stalled_mutex_);
    if (on_stalled_) on_stalled_();
  }

  static constexpr int kLongestCall_ticks = 20;  ///< two leases
  const GuardLimits limits_;
  mutable RtpsSessionState memory_;
  std::mutex discovery_;
  StallDetector stall_{kLongestCall_ticks};
  std::mutex stalled_mutex_;
  std::function<void()> on_stalled_;  // guarded by stalled_mutex_
  FragmentAssembly fragments_;
  mutable LivelinessTracker heard_;
  StaleParticipants stale_;
  std::optional<SuspendWatchdog> suspend_;  // its thread uses the above
  std::array<std::atomic<std::uint64_t>, kRtpsErrorCount> counts_{};
  std::atomic<bool> begun_{false};
  std::mutex begin_mutex_;
  std::condition_variable begun_changed_;
  UdpReceiver receiver_;  // last: its thread uses the rest
};

/// Puts a guard in front of each transport of these QoS (the builtin ones are first made explicit) and bounds
/// the number of stored participants and endpoints. Of `limits` only the sizes of samples are used; the rest
/// is computed.
std::shared_ptr<PacketGuard> guard_transports(dds::DomainParticipantQos& qos, std::uint32_t domain,
                                              bool encrypted, GuardLimits limits = {});

}  // namespace takt
