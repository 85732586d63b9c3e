#pragma once
// The guard in front of the transports of a participant: every packet that UDP or shared memory brings is
// inspected (rtps_guard.h) before Fast DDS sees it. What has a flaw is dropped and counted.
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "idl/transport/fastdds.h"
#include "idl/transport/heard.h"
#include "idl/transport/rtps_fragments.h"
#include "idl/transport/rtps_guard.h"
#include "idl/transport/rtps_packet_memory.h"

namespace takt {

/// What the guard of one participant has seen. Any thread.
class PacketGuard {
 public:
  explicit PacketGuard(const GuardLimits& limits)
      : limits_(limits), fragments_(limits.largest_sample_bytes, limits.most_fragments_joined) {}

  const GuardLimits& limits() const { return limits_; }
  PacketMemory& memory() { return memory_; }
  FragmentAssembly& fragments() { return fragments_; }
  HeardParticipants& heard() const { return heard_; }
  void count(PacketFlaw flaw) {
    counts_[static_cast<std::size_t>(flaw)].fetch_add(1, std::memory_order_relaxed);
  }

  /// How many packets had this flaw; `none`: how many were let through.
  std::uint64_t counted(PacketFlaw flaw) const {
    return counts_[static_cast<std::size_t>(flaw)].load(std::memory_order_relaxed);
  }
  /// Dropped as malformed. Encrypted packets that this participant cannot read are not among them.
  std::uint64_t dropped() const;
  /// "3 identity, 1 locator", or empty.
  std::string summary() const;

 private:
  const GuardLimits limits_;
  PacketMemory memory_;
  FragmentAssembly fragments_;
  mutable HeardParticipants heard_;
  std::array<std::atomic<std::uint64_t>, kPacketFlaws> counts_{};
};

/// Puts a guard in front of each transport of these QoS (the builtin ones are first made explicit) and bounds
/// how many participants and endpoints are remembered. Of `limits` the sizes of samples count, the rest is
/// found out.
std::shared_ptr<PacketGuard> guard_transports(dds::DomainParticipantQos& qos, std::uint32_t domain,
                                              bool encrypted, GuardLimits limits = {});

}  // namespace takt
