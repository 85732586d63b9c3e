#pragma once
// The guard in front of the transports of a participant: every packet that UDP or shared memory brings is
// inspected (rtps_guard.h) before Fast DDS sees it. What has a flaw is dropped and counted.
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "idl/transport/fastdds/fastdds.h"
#include "idl/transport/rtps_guard/liveliness_tracker.h"
#include "idl/transport/rtps_guard/rtps_fragments.h"
#include "idl/transport/rtps_guard/rtps_guard.h"
#include "idl/transport/rtps_guard/rtps_packet_memory.h"
#include "idl/transport/rtps_guard/suspend_detector.h"

namespace takt {

/// What the guard of one participant has seen. Any thread.
class PacketGuard : public std::enable_shared_from_this<PacketGuard> {
 public:
  /// `lease`: after such a silence participants forget each other; none: never.
  PacketGuard(const GuardLimits& limits, std::optional<std::chrono::nanoseconds> lease)
      : limits_(limits), fragments_(limits.largest_sample_bytes, limits.most_fragments_joined) {
    if (lease) suspend_.emplace(*lease);
  }

  /// Knows whom DDS knows, and forgets whom it forgets. Before the participant is made; the listener keeps
  /// the guard alive.
  void follow(DiscoveryListener& listener);

  const GuardLimits& limits() const { return limits_; }
  RtpsSessionState& memory() { return memory_; }
  /// Held while a packet of discovery is inspected and goes through Fast DDS. Its threads, one per port and
  /// way, would go through two at a time: one makes use of an endpoint that the other removes, and what it
  /// remembers is no longer what it was told (an assertion of 2.9.1 ended the service, once in some ten
  /// million mutated packets). Taken before all locks of DDS, and by nobody who holds one.
  std::mutex& discovery() { return discovery_; }
  FragmentAssembly& fragments() { return fragments_; }
  LivelinessTracker& heard() const { return heard_; }
  /// The process was stopped for long: nothing comes in for a moment (suspend_detector.h).
  bool quarantined() { return suspend_ && suspend_->quarantined(); }
  /// When that was noticed last; the clock's epoch: never.
  SuspendWatchdog::Clock::time_point returned() {
    return suspend_ ? suspend_->returned() : SuspendWatchdog::Clock::time_point{};
  }
  void count(RtpsError flaw) {
    counts_[static_cast<std::size_t>(flaw)].fetch_add(1, std::memory_order_relaxed);
  }

  /// How many packets had this flaw; `none`: how many were let through.
  std::uint64_t counted(RtpsError flaw) const {
    return counts_[static_cast<std::size_t>(flaw)].load(std::memory_order_relaxed);
  }
  /// Dropped as malformed. Encrypted packets that this participant cannot read are not among them.
  std::uint64_t dropped() const;
  /// "3 identity, 1 locator", or empty.
  std::string summary() const;

 private:
  const GuardLimits limits_;
  RtpsSessionState memory_;
  std::mutex discovery_;
  FragmentAssembly fragments_;
  mutable LivelinessTracker heard_;
  std::optional<SuspendWatchdog> suspend_;
  std::array<std::atomic<std::uint64_t>, kPacketFlaws> counts_{};
};

/// Puts a guard in front of each transport of these QoS (the builtin ones are first made explicit) and bounds
/// how many participants and endpoints are remembered. Of `limits` the sizes of samples count, the rest is
/// found out.
std::shared_ptr<PacketGuard> guard_transports(dds::DomainParticipantQos& qos, std::uint32_t domain,
                                              bool encrypted, GuardLimits limits = {});

}  // namespace takt
