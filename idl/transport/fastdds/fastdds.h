#pragma once
// The Fast DDS headers of this room under short names, and all differences between the majors of Fast DDS:
// 2.9.1 (Debian 12) and 3.1.2 (Debian 13). No other file depends on the major.
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#if __has_include(<fastdds/rtps/transport/ChainingTransport.hpp>)
#define TAKT_FAST_DDS_MAJOR 3
#include <fastdds/LibrarySettings.hpp>
#include <fastdds/rtps/common/PortParameters.hpp>
#include <fastdds/rtps/common/WriteParams.hpp>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.hpp>
#include <fastdds/rtps/writer/WriterDiscoveryStatus.hpp>
#include <fastdds/utils/IPLocator.hpp>
#else
#define TAKT_FAST_DDS_MAJOR 2
#include <fastdds/rtps/common/PortParameters.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#endif

#include <chrono>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "idl/common/cdr.h"

namespace takt {

namespace dds = eprosima::fastdds::dds;
namespace transports = eprosima::fastdds::rtps;
#if TAKT_FAST_DDS_MAJOR == 2
namespace rtps = eprosima::fastrtps::rtps;
using DdsReturnCode = eprosima::fastrtps::types::ReturnCode_t;
using DdsDuration = eprosima::fastrtps::Duration_t;
using DdsDiscoveryProtocol = rtps::DiscoveryProtocol_t;
inline constexpr bool kServersByPrefix = true;  ///< profiles list discovery servers with their GUID prefix
#else
namespace rtps = eprosima::fastdds::rtps;
using DdsReturnCode = dds::ReturnCode_t;
using DdsDuration = dds::Duration_t;
using DdsDiscoveryProtocol = rtps::DiscoveryProtocol;
inline constexpr bool kServersByPrefix = false;
#endif
using DdsGuid = rtps::GUID_t;

inline constexpr auto kGrowingMemory = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;

inline bool is_ok(const DdsReturnCode& code) {
#if TAKT_FAST_DDS_MAJOR == 2
  return code == DdsReturnCode::RETCODE_OK;
#else
  return code == dds::RETCODE_OK;
#endif
}

inline bool is_infinite(const DdsDuration& duration) {
#if TAKT_FAST_DDS_MAJOR == 2
  return duration == eprosima::fastrtps::c_TimeInfinite;
#else
  return duration == dds::c_TimeInfinite;
#endif
}

inline DdsGuid guid_of(const dds::InstanceHandle_t& handle) {
  return rtps::iHandle2GUID(handle);
}

inline std::string text_of(const DdsGuid& guid) {
  std::ostringstream text;
  text << guid;
  return text.str();
}

/// Sets how soon a reader learns of a lost sample: with the next sample or, 0.05 s later, with a heartbeat; the default of
/// 3 s is long for a reply without successor. `period_s` above 0: with a heartbeat alone, of that period; as each sample
/// with a heartbeat costs a timer of the writer and an acknowledgement, that suits streams. Heartbeats are sent only
/// while a sample is unacknowledged.
inline void beat_soon(dds::DataWriterQos& qos, double period_s) {
  auto& reliable = qos.reliable_writer_qos();
  reliable.disable_heartbeat_piggyback = period_s > 0.0;
  const DdsDuration period(period_s > 0.0 ? period_s : 0.05);
  // For so long after a sample requests to send it again are ignored. 0 runs out with each sample, in another thread.
  const DdsDuration suppression(0.5 * period_s);
#if TAKT_FAST_DDS_MAJOR == 2
  reliable.times.heartbeatPeriod = period;
  reliable.times.nackSupressionDuration = suppression;
#else
  reliable.times.heartbeat_period = period;
  reliable.times.nack_supression_duration = suppression;
#endif
}

/// Success of write() with one argument: `true` in one major, 0 in the other.
template <typename Sample>
bool written(dds::DataWriter& writer, Sample& sample) {
  return is_ok(writer.write(&sample, dds::HANDLE_NIL));
}
template <typename Sample>
bool written(dds::DataWriter& writer, Sample& sample, rtps::WriteParams& params) {
#if TAKT_FAST_DDS_MAJOR == 2
  return writer.write(&sample, params);
#else
  return is_ok(writer.write(&sample, params));
#endif
}

/// Between participants of this process, too, samples and discovery take the transports. Call it ahead of the first one. Else
/// Fast DDS calls one participant with locks of another held, and two that announce their liveliness at once wait for ever.
inline void deliver_through_transports() {
  static std::once_flag once;  // not while another thread makes a participant, which reads them
  std::call_once(once, [] {
#if TAKT_FAST_DDS_MAJOR == 2
    auto settings = eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings();
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
#else
    eprosima::fastdds::LibrarySettings settings;
    settings.intraprocess_delivery = eprosima::fastdds::INTRAPROCESS_OFF;
    (void)dds::DomainParticipantFactory::get_instance()->set_library_settings(settings);
#endif
  });
}

/// A writer of another participant, as reported by discovery.
struct DiscoveredWriter {
  enum class News { appeared, changed, gone };
  News news;
  DdsGuid guid;
  std::string topic, type;
  std::uint32_t ownership_strength;
  DdsDuration lease;
  bool latched, reliable, exclusive;  ///< late joiners get the newest; no sample is lost; the strongest wins
  std::string user_data;              ///< "typehash=RIHS01_...;" of ROS 2 and of takt
};

/// Reports remote writers; remote participants with their names; and remote participants, readers and writers that DDS
/// has dropped because they left or exceeded their lease.
class DiscoveryListener : public dds::DomainParticipantListener {
 public:
  /// A participant is discovered, ahead of its samples; its lease has expired; a participant or an endpoint
  /// has left.
  enum class Presence { come, silent, left };
  using Follower = std::function<void(const DdsGuid&, Presence)>;
  virtual void on_writer(const DiscoveredWriter&) {}
  /// `name` is what the participant calls itself, text from the network; empty once it is gone.
  virtual void on_participant(const DdsGuid&, const std::string& /*name*/) {}
  /// Set it ahead of the participant's construction. `follower` runs in threads of DDS.
  void follow(Follower follower) { follower_ = std::move(follower); }

 private:
#if TAKT_FAST_DDS_MAJOR == 2
  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) final {
    using Info = rtps::ParticipantDiscoveryInfo;
    if (info.status == Info::DISCOVERED_PARTICIPANT) notify(info.info.m_guid, Presence::come);
    if (info.status == Info::DROPPED_PARTICIPANT) notify(info.info.m_guid, Presence::silent);
    if (info.status == Info::REMOVED_PARTICIPANT) notify(info.info.m_guid, Presence::left);
    const bool gone = info.status == Info::REMOVED_PARTICIPANT || info.status == Info::DROPPED_PARTICIPANT;
    on_participant(info.info.m_guid, gone ? std::string() : info.info.m_participantName.to_string());
  }
  void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) final {
    if (info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER) notify(info.info.guid(), Presence::left);
  }
  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) final {
    using Info = rtps::WriterDiscoveryInfo;
    if (info.status == Info::REMOVED_WRITER) notify(info.info.guid(), Presence::left);
    const auto& qos = info.info.m_qos;
    on_writer({news_of(info.status == Info::DISCOVERED_WRITER, info.status == Info::CHANGED_QOS_WRITER),
               info.info.guid(), info.info.topicName().to_string(), info.info.typeName().to_string(),
               qos.m_ownershipStrength.value, qos.m_liveliness.lease_duration,
               qos.m_durability.kind != dds::VOLATILE_DURABILITY_QOS,
               qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
               qos.m_ownership.kind == dds::EXCLUSIVE_OWNERSHIP_QOS, bytes_of(qos.m_userData.data_vec())});
  }
#else
  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryStatus status,
                                const dds::ParticipantBuiltinTopicData& info, bool&) final {
    using News = rtps::ParticipantDiscoveryStatus;
    if (status == News::DISCOVERED_PARTICIPANT) notify(info.guid, Presence::come);
    if (status == News::DROPPED_PARTICIPANT) notify(info.guid, Presence::silent);
    if (status == News::REMOVED_PARTICIPANT) notify(info.guid, Presence::left);
    const bool gone = status == News::REMOVED_PARTICIPANT || status == News::DROPPED_PARTICIPANT;
    on_participant(info.guid, gone ? std::string() : info.participant_name.to_string());
  }
  void on_data_reader_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryStatus status,
                                const dds::SubscriptionBuiltinTopicData& info, bool&) final {
    if (status == rtps::ReaderDiscoveryStatus::REMOVED_READER) notify(info.guid, Presence::left);
  }
  void on_data_writer_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryStatus status,
                                const dds::PublicationBuiltinTopicData& info, bool&) final {
    using News = rtps::WriterDiscoveryStatus;
    if (status == News::REMOVED_WRITER) notify(info.guid, Presence::left);
    on_writer({news_of(status == News::DISCOVERED_WRITER, status == News::CHANGED_QOS_WRITER), info.guid,
               info.topic_name.to_string(), info.type_name.to_string(), info.ownership_strength.value,
               info.liveliness.lease_duration, info.durability.kind != dds::VOLATILE_DURABILITY_QOS,
               info.reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
               info.ownership.kind == dds::EXCLUSIVE_OWNERSHIP_QOS, bytes_of(info.user_data.data_vec())});
  }
#endif
  static std::string bytes_of(const std::vector<rtps::octet>& bytes) {
    return {bytes.begin(), bytes.end()};
  }
  static DiscoveredWriter::News news_of(bool appeared, bool changed) {
    using News = DiscoveredWriter::News;
    return appeared ? News::appeared : changed ? News::changed : News::gone;
  }
  void notify(const DdsGuid& guid, Presence presence) const {
    if (follower_) follower_(guid, presence);
  }
  Follower follower_;
};

/// A DDS type defined by the operations on its samples: make, size, write and read. It announces no type
/// object: in 2.9.1 a type object with a sequence of structs, announced by any peer, makes default
/// participants crash (Fast-DDS #3296).
class SampleType : public dds::TopicDataType {
 public:
  explicit SampleType(const std::string& name) {
    constexpr std::uint32_t kFirstRoom_bytes = 1U << 16U;  // memory grows with the samples
#if TAKT_FAST_DDS_MAJOR == 2
    setName(name.c_str());
    m_typeSize = kFirstRoom_bytes;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
#else
    set_name(name);
    max_serialized_type_size = kFirstRoom_bytes;
#endif
  }
#if TAKT_FAST_DDS_MAJOR == 2
  bool serialize(void* data, rtps::SerializedPayload_t* payload) final {
    return write_payload(data, *payload);
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) final {
    return read_payload(*payload, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) final {
    return [this, data] { return static_cast<std::uint32_t>(size(data)); };
  }
  void* createData() final {
    return make();
  }
  void deleteData(void* data) final {
    discard(data);
  }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) final {
    return false;
  }
#else
  bool serialize(const void* data, rtps::SerializedPayload_t& payload, dds::DataRepresentationId_t) final {
    return write_payload(data, payload);
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) final {
    return read_payload(payload, data);
  }
  std::uint32_t calculate_serialized_size(const void* data, dds::DataRepresentationId_t) final {
    return static_cast<std::uint32_t>(size(data));
  }
  void* create_data() final {
    return make();
  }
  void delete_data(void* data) final {
    discard(data);
  }
  bool compute_key(rtps::SerializedPayload_t&, rtps::InstanceHandle_t&, bool) final {
    return false;
  }
  bool compute_key(const void*, rtps::InstanceHandle_t&, bool) final {
    return false;
  }
#endif

 protected:
  virtual void* make() const = 0;
  virtual void discard(void* sample) const = 0;
  /// Bytes of the sample, including the four bytes of the encoding.
  virtual std::size_t size(const void* sample) const = 0;
  /// The same number, written to the beginning of `memory`; 0 if that is too small or the sample is invalid.
  virtual std::size_t write(const void* sample, std::span<std::uint8_t> memory) const = 0;
  /// False where the bytes are no sample.
  virtual bool read(std::span<const std::uint8_t> bytes, void* sample) const = 0;

 private:
  bool write_payload(const void* data, rtps::SerializedPayload_t& payload) const {
    payload.length = static_cast<std::uint32_t>(write(data, {payload.data, payload.max_size}));
    if (payload.length == 0) return false;
    payload.encapsulation = payload.data[1] == 1 ? CDR_LE : CDR_BE;
    return true;
  }
  /// An exception would go through the threads of Fast DDS and end the process.
  bool read_payload(const rtps::SerializedPayload_t& payload, void* data) const {
    try {
      return read({payload.data, payload.length}, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

/// A type whose values are the bytes of samples (std::string).
class BytesType final : public SampleType {
 public:
  using SampleType::SampleType;

 private:
  static constexpr std::size_t kHead_bytes = 4;
  static const std::string& bytes_of(const void* sample) { return *static_cast<const std::string*>(sample); }

  void* make() const override { return new std::string; }
  void discard(void* sample) const override { delete static_cast<std::string*>(sample); }
  std::size_t size(const void* sample) const override { return bytes_of(sample).size(); }
  std::size_t write(const void* sample, std::span<std::uint8_t> memory) const override {
    const std::string& bytes = bytes_of(sample);
    if (bytes.size() > memory.size() || bytes.size() < kHead_bytes) return 0;
    std::memcpy(memory.data(), bytes.data(), bytes.size());
    return bytes.size();
  }
  bool read(std::span<const std::uint8_t> bytes, void* sample) const override {
    static_cast<std::string*>(sample)->assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return bytes.size() >= kHead_bytes;
  }
};

/// A message of idl/*.idl by its field table.
template <Message Type>
class MessageType final : public SampleType {
 public:
  MessageType() : SampleType(std::string(message_info<Type>().dds_type)) {}

 private:
  static const Type& message_of(const void* sample) { return *static_cast<const Type*>(sample); }

  void* make() const override { return new Type; }
  void discard(void* sample) const override { delete static_cast<Type*>(sample); }
  std::size_t size(const void* sample) const override { return cdr::size(message_of(sample)); }
  std::size_t write(const void* sample, std::span<std::uint8_t> memory) const override {
    return cdr::write(message_of(sample), memory);
  }
  bool read(std::span<const std::uint8_t> bytes, void* sample) const override {
    return cdr::read(bytes, *static_cast<Type*>(sample));
  }
};

/// Sends a packet to one address.
inline bool send_packet(rtps::SenderResource& sender, std::span<const std::uint8_t> packet,
                        const rtps::Locator_t& to) {
  const std::vector<rtps::Locator_t> addresses{to};
  transports::Locators begin(addresses.begin()), end(addresses.end());
  const auto timeout = std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
  const auto bytes = static_cast<std::uint32_t>(packet.size());
#if TAKT_FAST_DDS_MAJOR == 2
  return sender.send(packet.data(), bytes, &begin, &end, timeout);
#else
  return sender.send({{packet.data(), bytes}}, bytes, &begin, &end, timeout);
#endif
}

/// A transport in front of another one: observes sent packets and may send them its own way, filters received ones.
class ChainedTransport : public transports::ChainingTransport {
 public:
  explicit ChainedTransport(const transports::ChainingTransportDescriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor.low_level_descriptor) {}
  transports::TransportDescriptorInterface* get_configuration() override { return descriptor_.get(); }
  void shutdown() override { low_level_transport_->shutdown(); }

 protected:
  /// Sends the packet to these addresses, and returns whether that succeeded.
  using Pass = std::function<bool(rtps::LocatorsIterator& begin, rtps::LocatorsIterator& end)>;
  /// A packet is to be sent. Fast DDS calls it once for each `sender`: for shared memory, or for the socket of each
  /// network interface.
  virtual bool sending(std::span<const std::uint8_t> packet, rtps::SenderResource& sender,
                       rtps::LocatorsIterator& begin, rtps::LocatorsIterator& end, const Pass& pass) = 0;

 private:
#if TAKT_FAST_DDS_MAJOR == 2
  bool send(rtps::SenderResource* sender, const rtps::octet* data, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) final {
    const auto pass = [&](rtps::LocatorsIterator& from, rtps::LocatorsIterator& to) {
      return sender->send(data, size, &from, &to, timeout);
    };
    return sending({data, size}, *sender, *begin, *end, std::cref(pass));
  }
#else
  bool send(rtps::SenderResource* sender, const std::vector<transports::NetworkBuffer>& buffers,
            std::uint32_t size, rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) final {
    thread_local std::vector<transports::NetworkBuffer> pieces;
    pieces.assign(buffers.begin(), buffers.end());
    // Shared memory of 3.1.2 reserves space for the statistics at the end without copying them: the space
    // would send old bytes.
    if (kind() == LOCATOR_KIND_SHM && !pieces.empty() && is_statistics(pieces.back())) {
      size -= pieces.back().size;
      pieces.pop_back();
    }
    thread_local std::vector<std::uint8_t> packet;
    packet.clear();
    for (const auto& piece : pieces) {
      const auto* bytes = static_cast<const std::uint8_t*>(piece.buffer);
      packet.insert(packet.end(), bytes, bytes + piece.size);
    }
    const auto pass = [&](rtps::LocatorsIterator& from, rtps::LocatorsIterator& to) {
      return sender->send(pieces, size, &from, &to, timeout);
    };
    return sending(packet, *sender, *begin, *end, std::cref(pass));
  }
  /// A submessage that only Fast DDS has: 0x80, little endian, 56 bytes behind its head of four.
  static bool is_statistics(const transports::NetworkBuffer& piece) {
    constexpr std::uint8_t head[] = {0x80, 0x01, 56, 0};
    return piece.size == 60 && std::memcmp(piece.buffer, head, sizeof(head)) == 0;
  }
#endif
  std::shared_ptr<transports::TransportDescriptorInterface> descriptor_;
};

}  // namespace takt
