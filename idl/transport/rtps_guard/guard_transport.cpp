#include "idl/transport/rtps_guard/guard_transport.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <new>
#include <span>
#include <vector>

#include "idl/transport/fastdds/host_local_udp.h"
#include "idl/transport/rtps_guard/packet_cork.h"
#include "idl/transport/rtps_guard/rtps_submessage.h"
#include "idl/transport/rtps_guard/wire_cursor.h"

namespace takt {
namespace {

std::uint32_t now_s() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME_COARSE, &now);
  return static_cast<std::uint32_t>(now.tv_sec);
}

/// A copy of a packet: in shared memory other processes read the same bytes, and may write them. A packet
/// with a fragment is followed by zeros: Fast DDS copies fragments with the sizes of an earlier packet, and
/// so may read up to a whole sample beyond the end. Pages that are only read cost no memory.
class PacketCopy {
 public:
  PacketCopy() = default;
  PacketCopy(const PacketCopy&) = delete;
  PacketCopy& operator=(const PacketCopy&) = delete;
  ~PacketCopy() {
    if (pages_ != nullptr) munmap(pages_, capacity_);
  }
  std::span<std::uint8_t> take(std::span<const std::uint8_t> packet, std::size_t readable_behind) {
    const std::size_t wanted = packet.size() + readable_behind;
    if (wanted > capacity_) grow(wanted + (1U << 16U));
    if (!packet.empty()) std::memcpy(pages_, packet.data(), packet.size());
    written_ = std::max(written_, packet.size());
    return {pages_, packet.size()};
  }
  void clear_behind(std::size_t size) {
    if (size < written_) std::memset(pages_ + size, 0, written_ - size);
    written_ = size;
  }

 private:
  void grow(std::size_t wanted) {
    void* pages =
        mmap(nullptr, wanted, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED) throw std::bad_alloc();
    if (pages_ != nullptr) munmap(pages_, capacity_);
    pages_ = static_cast<std::uint8_t*>(pages);
    capacity_ = wanted;
    written_ = 0;
  }
  std::uint8_t* pages_ = nullptr;
  std::size_t capacity_ = 0, written_ = 0;
};

/// The packet with which a participant says that it ends.
std::array<std::uint8_t, 76> farewell_of(const ParticipantPlaces::Prefix& participant, std::int64_t number) {
  constexpr std::uint8_t inline_parameters = 2;
  std::array<std::uint8_t, 76> packet{'R',   'T',
                                      'P',   'S',
                                      2,     2,
                                      1,     15,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,  //
                                      kData, inline_parameters,
                                      0,     52,
                                      0,     0,
                                      0,     16,  // big endian; 16 bytes to the parameters
                                      0,     1,
                                      0,     0xc7,
                                      0,     1,
                                      0,     0xc2,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,  // reader, writer, number
                                      0,     0x70,
                                      0,     16,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      0,     0,
                                      1,     0xc1,  // key: its GUID
                                      0,     0x71,
                                      0,     4,
                                      0,     0,
                                      0,     3,
                                      0,     1,
                                      0,     0};  // disposed, unregistered; end
  constexpr std::size_t sender_at = 8, number_at = 36, key_at = 48;
  std::copy(participant.begin(), participant.end(), packet.begin() + sender_at);
  std::copy(participant.begin(), participant.end(), packet.begin() + key_at);
  for (std::size_t i = 0; i < 8; ++i)
    packet[number_at + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(number) >> (8 * (7 - i)));
  return packet;
}

/// A packet of this participant: its reader acknowledges the samples of an own writer up to number `last`. Fast DDS then
/// ignores further requests of that reader.
std::array<std::uint8_t, 48> last_acknowledgement(std::span<const std::uint8_t> participant,
                                                  std::uint32_t reader, std::uint32_t writer,
                                                  std::int64_t last) {
  constexpr std::uint8_t final = 2;
  std::array<std::uint8_t, 48> packet{'R', 'T', 'P', 'S', 2, 2, 1, 15};
  std::size_t at = 8;
  const auto put = [&](std::uint64_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) packet[at++] = static_cast<std::uint8_t>(value >> (8 * i));
  };
  for (const std::uint8_t byte : participant.first(12)) put(byte, 1);
  put(kAckNack, 1);
  put(final, 1);  // big endian
  put(24, 2);
  put(reader, 4);
  put(writer, 4);
  put(static_cast<std::uint64_t>(last) + 1, 8);
  put(0, 4);            // requests nothing
  put(0xffffffffU, 4);  // count
  return packet;
}

/// Ports of samples to one participant (RTPS 9.6.1.1): PB + DG * domain + d3 + PG * participant.
struct SamplePorts {
  std::uint32_t first, distance, count;
  bool has(std::uint32_t port) const {
    return port >= first && (port - first) % distance == 0 && (port - first) / distance < count;
  }
};

class GuardTransport final : public ChainedTransport {
 public:
  GuardTransport(const transports::ChainingTransportDescriptor& descriptor,
                 std::shared_ptr<PacketGuard> guard, const ThisMachineUdp* this_machine, SamplePorts ports)
      : ChainedTransport(descriptor), guard_(std::move(guard)), ports_(ports) {
    if (this_machine == nullptr) return;
    local_.emplace();
    buffer_bytes_ = this_machine->receiveBufferSize;
  }

  // Samples from this machine are received by the guard's receiver, so that a thread may wait for them there.
  bool OpenInputChannel(const rtps::Locator_t& at, transports::TransportReceiverInterface* next,
                        std::uint32_t largest_bytes) override {
    if (!brings_samples(at)) return ChainedTransport::OpenInputChannel(at, next, largest_bytes);
    return guard_->receiver().open(
        static_cast<std::uint16_t>(at.port), local_ipv4_addresses(), buffer_bytes_,
        [this, at, next](std::span<const std::uint8_t> packet, const Ipv4& from, std::uint16_t from_port) {
          rtps::Locator_t remote;
          remote.kind = LOCATOR_KIND_UDPv4;
          remote.port = from_port;
          std::copy(from.begin(), from.end(), remote.address + kIpv4Place);
          receive(next, packet.data(), static_cast<std::uint32_t>(packet.size()), at, remote);
        });
  }
  bool IsInputChannelOpen(const rtps::Locator_t& at) const override {
    return brings_samples(at) ? guard_->receiver().is_open(static_cast<std::uint16_t>(at.port))
                              : ChainedTransport::IsInputChannelOpen(at);
  }
  bool CloseInputChannel(const rtps::Locator_t& at) override {
    guard_->begin();  // a thread that waits for it would not end
    if (!brings_samples(at)) return ChainedTransport::CloseInputChannel(at);
    guard_->receiver().close(static_cast<std::uint16_t>(at.port));
    return true;
  }

  void receive(transports::TransportReceiverInterface* next, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    if (!brings_samples(local)) guard_->wait_for_begin();
    if (guard_->quarantined() || guard_->stale().sent({data, size}) || is_foreign(remote)) return;
    thread_local PacketCopy copy;
    const std::span<std::uint8_t> packet = copy.take({data, size}, guard_->limits().largest_sample_bytes);
    std::optional<PacketGuard::Discovery> one_at_a_time;
    if (speaks_of_discovery(packet)) one_at_a_time.emplace(*guard_);
    if (one_at_a_time) say_held_farewells(next);
    const PacketReport report =
        clean_packet(packet, guard_->limits(), &guard_->memory(), now_s(), origin_of(local, remote));
    // Announcements from a further socket of a participant are usual, and come from the first one too.
    if (report.flaw == RtpsError::source && only_announces(packet)) return;
    guard_->count(report.flaw);
    if (report.flaw != RtpsError::none) return;
    guard_->heard().note(packet);
    const auto deliver = [&](std::span<std::uint8_t> bytes) {
      next->OnDataReceived(bytes.data(), static_cast<std::uint32_t>(bytes.size()), local, remote);
    };
    if (one_at_a_time) make_places(deliver);
    if (one_at_a_time && !guard_->limits().relayed_discovery && ends_participant(packet)) {
      if (guard_->limits().encrypted) return hold_farewell(packet.first(report.size), next, local, remote);
      acknowledge_all(packet.subspan(kSenderAt, 12), deliver);
    }
    if (!report.fragments) return deliver(packet.first(report.size));
    copy.clear_behind(report.size);
    deliver(packet.first(guard_->fragments().take(packet.first(report.size), deliver)));
  }

  /// The addresses under which other participants reach this one. Fast DDS omits loopback if there is another
  /// interface; a participant that listens on loopback alone would be unreachable.
  rtps::LocatorList_t NormalizeLocator(const rtps::Locator_t& locator) override {
    rtps::LocatorList_t addresses = low_level_transport_->NormalizeLocator(locator);
    const bool any = std::all_of(locator.address + kIpv4Place, locator.address + 16,
                                 [](rtps::octet part) { return part == 0; });
    if (!local_ || locator.kind != LOCATOR_KIND_UDPv4 || !any) return addresses;
    rtps::Locator_t loopback = locator;
    std::copy(kLoopback.begin(), kLoopback.end(), loopback.address + kIpv4Place);
    if (std::find(addresses.begin(), addresses.end(), loopback) == addresses.end())
      addresses.push_back(loopback);
    return addresses;
  }

 private:
  static constexpr std::size_t kIpv4Place = 12;  ///< in a locator's address
  bool brings_samples(const rtps::Locator_t& at) const {
    return local_ && at.kind == LOCATOR_KIND_UDPv4 && !rtps::IPLocator::isMulticast(at) &&
           ports_.has(at.port);
  }
  bool is_foreign(const rtps::Locator_t& remote) {
    if (!local_ || remote.kind != LOCATOR_KIND_UDPv4) return false;
    Ipv4 address{};
    std::copy_n(remote.address + kIpv4Place, address.size(), address.begin());
    return !local_->has(address);
  }
  static PacketOrigin origin_of(const rtps::Locator_t& local, const rtps::Locator_t& remote) {
    if (local.kind == LOCATOR_KIND_SHM) return TransportKind::shared_memory;
    PacketOrigin origin;
    origin.address = mixed(remote.address, 0);
    origin.source = mixed(remote.address, remote.port);
    return origin;
  }
  /// Says farewell for participants that have to give way. Called ahead of a packet of discovery.
  template <typename Deliver>
  void make_places(const Deliver& deliver) {
    while (const auto one = guard_->memory().overdue_participant()) {
      auto farewell = farewell_of(one->participant, one->number);
      acknowledge_all(one->participant, deliver);
      deliver(farewell);
    }
  }
  /// A participant that leaves acknowledges the announcements of endpoints first. Fast DDS 2.9.1 removes such an
  /// announcement when no reader lacks it any more, and waits for the thread that repeats it: while it handles an
  /// acknowledgement it holds nothing that this thread needs, while it drops a participant it does (decision 400).
  template <typename Deliver>
  void acknowledge_all(std::span<const std::uint8_t> participant, const Deliver& deliver) {
    const auto acknowledge = [&](AnnouncedEndpoints kind, std::uint32_t reader, std::uint32_t writer) {
      const std::int64_t last = guard_->memory().last_announcement(kind);
      if (last == 0) return;
      auto acknowledgement = last_acknowledgement(participant, reader, writer, last);
      deliver(acknowledgement);
    };
    acknowledge(AnnouncedEndpoints::writers, kPublicationsReader, kPublicationsWriter);
    acknowledge(AnnouncedEndpoints::readers, kSubscriptionsReader, kSubscriptionsWriter);
  }
  /// The same for encrypted announcements, whose numbers the guard cannot read: the farewell waits until Fast DDS has
  /// repeated what the participant has requested, and comes ahead of a later packet of discovery. 2.9.1 repeats
  /// announcements 0.1 ms after the request.
  void hold_farewell(std::span<const std::uint8_t> packet, transports::TransportReceiverInterface* next,
                     const rtps::Locator_t& local, const rtps::Locator_t& remote) {
    constexpr std::chrono::milliseconds repeated_within{50};
    constexpr std::size_t most = 256;  // participants; beyond, leases end
    if (held_farewells_.size() >= most) return;
    held_farewells_.push_back(
        {{packet.begin(), packet.end()}, next, local, remote, Clock::now() + repeated_within});
  }
  void say_held_farewells(transports::TransportReceiverInterface* next) {
    if (held_farewells_.empty()) return;
    const auto now = Clock::now();
    std::erase_if(held_farewells_, [&](HeldFarewell& one) {
      if (one.next != next || one.due > now) return false;
      next->OnDataReceived(one.packet.data(), static_cast<std::uint32_t>(one.packet.size()), one.local,
                           one.remote);
      return true;
    });
  }
  bool sending(std::span<const std::uint8_t> packet, rtps::SenderResource& sender,
               rtps::LocatorsIterator& begin, rtps::LocatorsIterator& end, const Pass& pass) override {
    if (guard_->quarantined()) return true;
    const rtps::SenderResource* first = nullptr;
    if (first_sender_.compare_exchange_strong(first, &sender)) first = &sender;
    if (first == &sender) {
      guard_->memory().note(packet);
      guard_->fragments().sending(packet);
    }
    if (!local_) return pass(begin, end);
    const auto is_unicast = [](const rtps::Locator_t& to) {
      return to.kind == LOCATOR_KIND_UDPv4 && !rtps::IPLocator::isMulticast(to);
    };
    // Fast DDS sends each packet through the sockets of all listed interfaces. On this machine each socket reaches every
    // unicast address, so a packet would arrive as often as there are interfaces.
    thread_local bool sent = false;
    if (first != &sender && sent) return pass_on(begin, end, pass, std::not_fn(is_unicast));
    PacketCork* cork = guard_->limits().encrypted ? nullptr : PacketCork::of_thread();
    if (cork == nullptr) return sent = pass(begin, end);
    return sent = pass_on(begin, end, pass, [&](const rtps::Locator_t& to) {
             return !is_unicast(to) || !cork->hold(sender, to, packet, kLargestJoined_bytes);
           });
  }
  /// To those of the addresses that are wanted.
  template <typename Wanted>
  static bool pass_on(rtps::LocatorsIterator& begin, rtps::LocatorsIterator& end, const Pass& pass,
                      const Wanted& wanted) {
    thread_local rtps::LocatorList_t addresses;
    addresses.clear();
    for (; begin != end; ++begin)
      if (wanted(*begin)) addresses.push_back(*begin);
    if (addresses.empty()) return true;
    transports::Locators first(addresses.begin()), last(addresses.end());
    return pass(first, last);
  }
  static constexpr std::size_t kLargestJoined_bytes = 60000;  ///< below the largest datagram

  using Clock = std::chrono::steady_clock;
  struct HeldFarewell {
    std::vector<std::uint8_t> packet;
    transports::TransportReceiverInterface* next;
    rtps::Locator_t local, remote;
    Clock::time_point due;
  };

  std::shared_ptr<PacketGuard> guard_;
  std::vector<HeldFarewell> held_farewells_;  // guarded by PacketGuard::Discovery
  const SamplePorts ports_;
  std::optional<LocalAddresses> local_;
  std::uint32_t buffer_bytes_ = 0;
  std::atomic<const rtps::SenderResource*> first_sender_{nullptr};
};

struct GuardTransportDescriptor final : public transports::ChainingTransportDescriptor {
  GuardTransportDescriptor(std::shared_ptr<transports::TransportDescriptorInterface> low_level,
                           std::shared_ptr<PacketGuard> packet_guard, SamplePorts sample_ports)
      : ChainingTransportDescriptor(std::move(low_level)),
        guard(std::move(packet_guard)),
        ports(sample_ports) {}
  transports::TransportInterface* create_transport() const override {
    const auto* this_machine = dynamic_cast<const ThisMachineUdp*>(low_level_descriptor.get());
    return new GuardTransport(*this, guard, this_machine, ports);
  }

  std::shared_ptr<PacketGuard> guard;
  SamplePorts ports;
};

void bound_what_is_remembered(dds::DomainParticipantQos& qos) {
  auto& allocation = qos.allocation();
  allocation.participants.maximum = 256;
  allocation.readers.maximum = 1024;  // of each participant
  allocation.writers.maximum = 1024;
}

}  // namespace

bool PacketGuard::is_synchronised(const rtps::GuidPrefix_t& participant,
                                  const rtps::EntityId_t& writer) const {
  if (limits_.encrypted) return true;
  ParticipantPlaces::Prefix prefix{};
  std::copy_n(participant.value, prefix.size(), prefix.begin());
  return memory_.is_synchronised(prefix, WireCursor({writer.value, 4}, true).entity_id());
}

void PacketGuard::follow(DiscoveryListener& listener) {
  using Presence = DiscoveryListener::Presence;
  listener.follow([guard = shared_from_this()](const DdsGuid& guid, Presence presence) {
    std::array<std::uint8_t, 16> bytes{};
    std::copy_n(guid.entityId.value, 4, std::copy_n(guid.guidPrefix.value, 12, bytes.begin()));
    if (guid.entityId == rtps::c_EntityId_RTPSParticipant) guard->follow(guid.guidPrefix, presence);
    switch (presence) {
      case Presence::come:
        return guard->memory_.know(bytes);
      case Presence::silent:
        return guard->memory_.forget_silent(bytes);
      case Presence::left:
        return guard->memory_.forget(bytes);
    }
  });
}

void PacketGuard::follow(const rtps::GuidPrefix_t& participant, DiscoveryListener::Presence presence) {
  StaleParticipants::Prefix prefix{};
  std::copy_n(participant.value, prefix.size(), prefix.begin());
  if (presence == DiscoveryListener::Presence::come)
    stale_.discovered(prefix);
  else
    stale_.dropped(prefix);
}

std::uint64_t PacketGuard::dropped() const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kRtpsErrorCount; ++i) {
    const auto flaw = static_cast<RtpsError>(i);
    if (flaw != RtpsError::none && flaw != RtpsError::encrypted) sum += counted(flaw);
  }
  return sum;
}

std::string PacketGuard::summary() const {
  std::string text;
  for (std::size_t i = 1; i < kRtpsErrorCount; ++i) {
    const auto flaw = static_cast<RtpsError>(i);
    const std::uint64_t count = counted(flaw);
    if (count == 0) continue;
    if (!text.empty()) text += ", ";
    text += std::to_string(count) + " " + std::string(to_string(flaw));
  }
  return text;
}

std::shared_ptr<PacketGuard> guard_transports(dds::DomainParticipantQos& qos, std::uint32_t domain,
                                              bool encrypted, GuardLimits limits) {
  auto& transports = qos.transport();
  if (transports.use_builtin_transports) {
    transports.user_transports.push_back(std::make_shared<transports::SharedMemTransportDescriptor>());
    transports.user_transports.push_back(std::make_shared<transports::UDPv4TransportDescriptor>());
    transports.use_builtin_transports = false;
  }
  const auto& wire = qos.wire_protocol();
  limits.encrypted = encrypted;
  limits.relayed_discovery =
      wire.builtin.discovery_config.discoveryProtocol != DdsDiscoveryProtocol::SIMPLE ||
      std::getenv("ROS_DISCOVERY_SERVER") != nullptr;
  limits.first_shared_memory_port = wire.port.portBase + wire.port.domainIDGain * domain;
  limits.last_shared_memory_port = limits.first_shared_memory_port + 2U * wire.port.domainIDGain;
  std::optional<std::chrono::nanoseconds> lease;
  if (const auto& own = wire.builtin.discovery_config.leaseDuration; !is_infinite(own))
    lease = std::chrono::seconds(own.seconds) + std::chrono::nanoseconds(own.nanosec);
  auto guard = std::make_shared<PacketGuard>(limits, lease);
  SamplePorts ports{};
  ports.distance = std::max<std::uint32_t>(wire.port.participantIDGain, 1);
  ports.count = wire.port.domainIDGain / ports.distance;
  ports.first = wire.port.portBase + wire.port.domainIDGain * domain + wire.port.offsetd3;
  for (auto& descriptor : transports.user_transports)
    descriptor = std::make_shared<GuardTransportDescriptor>(descriptor, guard, ports);
  bound_what_is_remembered(qos);
  return guard;
}

}  // namespace takt
