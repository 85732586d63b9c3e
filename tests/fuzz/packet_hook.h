#pragma once
// Observes the packets received by the transports of a participant, and injects packets at the same place,
// ahead of any guard.
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "idl/transport/fastdds/fastdds.h"

namespace takt::test {

class PacketHook {
 public:
  using Receiver = transports::TransportReceiverInterface;
  struct Recorded {
    std::size_t channel;
    std::vector<std::uint8_t> bytes;
  };

  /// Puts the hook behind all transports of these QoS.
  static void attach(const std::shared_ptr<PacketHook>& hook, dds::DomainParticipantQos& qos);

  void received(Receiver* next, const std::uint8_t* data, std::uint32_t size, const rtps::Locator_t& local,
                const rtps::Locator_t& remote) {
    Channel& channel = channel_of(next, local, remote);
    {
      const std::lock_guard lock(mutex_);
      if (recording_ && recorded_.size() < kMaxRecorded)
        recorded_.push_back({channel.index, {data, data + size}});
    }
    const std::lock_guard lock(channel.mutex);
    next->OnDataReceived(data, size, local, remote);
  }
  /// As if the channel had received it. Fast DDS reads one packet at a time from a channel; so here.
  void inject(std::size_t index, const std::vector<std::uint8_t>& packet) {
    Channel* channel = nullptr;
    {
      const std::lock_guard lock(mutex_);
      channel = &channels_.at(index);
    }
    const std::lock_guard lock(channel->mutex);
    channel->next->OnDataReceived(packet.data(), static_cast<std::uint32_t>(packet.size()), channel->local,
                                  channel->remote);
  }
  std::vector<Recorded> stop_recording() {
    const std::lock_guard lock(mutex_);
    recording_ = false;
    return std::move(recorded_);
  }
  void opened(const rtps::Locator_t& local) {
    const std::lock_guard lock(mutex_);
    if (local.kind == LOCATOR_KIND_UDPv4 && !rtps::IPLocator::isMulticast(local))
      udp_ports_.push_back(static_cast<std::uint16_t>(local.port));
  }
  /// Ports of this participant alone, without the ports of others that it tried.
  std::vector<std::uint16_t> udp_ports() {
    const std::lock_guard lock(mutex_);
    return udp_ports_;
  }

 private:
  static constexpr std::size_t kMaxRecorded = 2000;
  struct Channel {
    Channel(std::size_t number, Receiver* receiver, const rtps::Locator_t& here, const rtps::Locator_t& there)
        : index(number), next(receiver), local(here), remote(there) {}
    std::size_t index;
    Receiver* next;
    rtps::Locator_t local, remote;
    std::mutex mutex;
  };
  Channel& channel_of(Receiver* next, const rtps::Locator_t& local, const rtps::Locator_t& remote) {
    const std::lock_guard lock(mutex_);
    for (Channel& channel : channels_)
      if (channel.next == next) return channel;
    return channels_.emplace_back(channels_.size(), next, local, remote);
  }

  std::mutex mutex_;
  bool recording_ = true;
  std::deque<Channel> channels_;
  std::vector<Recorded> recorded_;
  std::vector<std::uint16_t> udp_ports_;
};

class HookTransport final : public ChainedTransport {
 public:
  HookTransport(const transports::ChainingTransportDescriptor& descriptor, std::shared_ptr<PacketHook> hook)
      : ChainedTransport(descriptor), hook_(std::move(hook)) {}
  bool OpenInputChannel(const rtps::Locator_t& local, PacketHook::Receiver* receiver,
                        std::uint32_t size) override {
    if (!ChainingTransport::OpenInputChannel(local, receiver, size)) return false;
    hook_->opened(local);
    return true;
  }
  /// Forwards the call. Of two chained transports Fast DDS does not recognise its own senders, opens another
  /// one for each announced address, and sends every packet by all of them.
  bool OpenOutputChannel(transports::SendResourceList& senders, const rtps::Locator_t& remote) override {
    return low_level_transport_->OpenOutputChannel(senders, remote);
  }
  void receive(transports::TransportReceiverInterface* next, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    hook_->received(next, data, size, local, remote);
  }

 private:
  bool sending(std::span<const std::uint8_t>, rtps::SenderResource&, rtps::LocatorsIterator& begin,
               rtps::LocatorsIterator& end, const Pass& pass) override {
    return pass(begin, end);
  }
  std::shared_ptr<PacketHook> hook_;
};

struct HookTransportDescriptor final : public transports::ChainingTransportDescriptor {
  HookTransportDescriptor(std::shared_ptr<transports::TransportDescriptorInterface> low_level,
                          std::shared_ptr<PacketHook> packet_hook)
      : ChainingTransportDescriptor(std::move(low_level)), hook(std::move(packet_hook)) {}
  transports::TransportInterface* create_transport() const override { return new HookTransport(*this, hook); }
  std::shared_ptr<PacketHook> hook;
};

inline void PacketHook::attach(const std::shared_ptr<PacketHook>& hook, dds::DomainParticipantQos& qos) {
  for (auto& descriptor : qos.transport().user_transports)
    descriptor = std::make_shared<HookTransportDescriptor>(descriptor, hook);
}

}  // namespace takt::test
