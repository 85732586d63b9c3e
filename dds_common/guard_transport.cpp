#include "dds_common/guard_transport.h"

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <sys/mman.h>

#include <cstdlib>
#include <cstring>
#include <new>
#include <span>

namespace takt {
namespace {

namespace transport = eprosima::fastdds::rtps;

/// A copy of a packet with zeros behind it. Fast DDS copies a fragment by sizes that an earlier packet has
/// told, and so may read behind this one: up to a whole sample. Pages that are only read cost no memory.
class PacketCopy {
 public:
  ~PacketCopy() {
    if (pages_ != nullptr) munmap(pages_, capacity_);
  }
  std::uint8_t* take(std::span<const std::uint8_t> packet, std::size_t readable_behind) {
    const std::size_t wanted = packet.size() + readable_behind;
    if (wanted > capacity_) grow(wanted + (1U << 16U));
    std::memcpy(pages_, packet.data(), packet.size());
    // Only what an earlier, longer packet has left is to be cleared.
    if (packet.size() < used_) std::memset(pages_ + packet.size(), 0, used_ - packet.size());
    used_ = packet.size();
    return pages_;
  }

 private:
  void grow(std::size_t wanted) {
    void* pages =
        mmap(nullptr, wanted, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED) throw std::bad_alloc();
    if (pages_ != nullptr) munmap(pages_, capacity_);
    pages_ = static_cast<std::uint8_t*>(pages);
    capacity_ = wanted;
    used_ = 0;
  }
  std::uint8_t* pages_ = nullptr;
  std::size_t capacity_ = 0, used_ = 0;
};

class GuardTransport final : public transport::ChainingTransport {
 public:
  GuardTransport(const transport::ChainingTransportDescriptor& descriptor, std::shared_ptr<PacketGuard> guard)
      : ChainingTransport(descriptor),
        descriptor_(descriptor.low_level_descriptor),
        guard_(std::move(guard)) {}

  transport::TransportDescriptorInterface* get_configuration() override { return descriptor_.get(); }
  void shutdown() override { low_level_transport_->shutdown(); }

  bool send(rtps::SenderResource* sender, const rtps::octet* data, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    guard_->sent().note({data, size});
    return sender->send(data, size, begin, end, timeout);
  }

  void receive(transport::TransportReceiverInterface* next, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    const std::span packet(data, size);
    const PacketReport report = inspect_packet(packet, guard_->limits(), &guard_->sent());
    guard_->count(report.flaw);
    if (report.flaw != PacketFlaw::none) return;
    guard_->heard().note(packet);
    if (!report.hides && !report.fragments) {
      next->OnDataReceived(data, size, local, remote);
      return;
    }
    // Never in place: in shared memory others read the same bytes.
    thread_local PacketCopy copy;
    std::uint8_t* bytes = copy.take(packet, report.fragments ? guard_->limits().largest_sample_bytes : 0);
    if (report.hides) hide_parameters({bytes, size}, guard_->limits());
    next->OnDataReceived(bytes, size, local, remote);
  }

 private:
  std::shared_ptr<transport::TransportDescriptorInterface> descriptor_;
  std::shared_ptr<PacketGuard> guard_;
};

struct GuardTransportDescriptor final : public transport::ChainingTransportDescriptor {
  GuardTransportDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> low_level,
                           std::shared_ptr<PacketGuard> packet_guard)
      : ChainingTransportDescriptor(std::move(low_level)), guard(std::move(packet_guard)) {}
  transport::TransportInterface* create_transport() const override {
    return new GuardTransport(*this, guard);
  }

  std::shared_ptr<PacketGuard> guard;
};

void bound_what_is_remembered(dds::DomainParticipantQos& qos) {
  auto& allocation = qos.allocation();
  allocation.participants.maximum = 256;
  allocation.readers.maximum = 1024;  // of each participant
  allocation.writers.maximum = 1024;
}

}  // namespace

std::uint64_t PacketGuard::dropped() const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kPacketFlaws; ++i) {
    const auto flaw = static_cast<PacketFlaw>(i);
    if (flaw != PacketFlaw::none && flaw != PacketFlaw::encrypted) sum += counted(flaw);
  }
  return sum;
}

std::string PacketGuard::summary() const {
  std::string text;
  for (std::size_t i = 1; i < kPacketFlaws; ++i) {
    const auto flaw = static_cast<PacketFlaw>(i);
    const std::uint64_t count = counted(flaw);
    if (count == 0) continue;
    if (!text.empty()) text += ", ";
    text += std::to_string(count) + " " + std::string(to_string(flaw));
  }
  return text;
}

std::shared_ptr<PacketGuard> guard_transports(dds::DomainParticipantQos& qos, std::uint32_t domain,
                                              bool encrypted, std::uint32_t largest_sample_bytes) {
  auto& transports = qos.transport();
  if (transports.use_builtin_transports) {
    transports.user_transports.push_back(std::make_shared<transport::SharedMemTransportDescriptor>());
    transports.user_transports.push_back(std::make_shared<transport::UDPv4TransportDescriptor>());
    transports.use_builtin_transports = false;
  }
  const auto& wire = qos.wire_protocol();
  GuardLimits limits;
  limits.largest_sample_bytes = largest_sample_bytes;
  limits.encrypted = encrypted;
  limits.relayed_discovery =
      wire.builtin.discovery_config.discoveryProtocol != rtps::DiscoveryProtocol_t::SIMPLE ||
      std::getenv("ROS_DISCOVERY_SERVER") != nullptr;
  limits.first_shared_memory_port = wire.port.portBase + wire.port.domainIDGain * domain;
  limits.last_shared_memory_port = limits.first_shared_memory_port + 2U * wire.port.domainIDGain;
  auto guard = std::make_shared<PacketGuard>(limits);
  for (auto& descriptor : transports.user_transports)
    descriptor = std::make_shared<GuardTransportDescriptor>(descriptor, guard);
  bound_what_is_remembered(qos);
  return guard;
}

}  // namespace takt
