#pragma once
// One DDS participant: makes topics, writers and readers, and turns every refusal of DDS into an error with a
// sentence.
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "idl/transport/fastdds/fastdds.h"
#include "idl/transport/fastdds/topic_qos.h"
#include "idl/transport/rtps_guard/guard_transport.h"

namespace takt {

/// DDS failed; what() is a whole sentence.
class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ParticipantOptions {
  std::string name;          ///< shown to other participants
  std::uint32_t domain = 0;  ///< 0..232
  /// Fast DDS profiles (XML) with a participant profile of the name `profile`. Empty: this machine only, by UDP
  /// (idl/transport/fastdds/host_local_udp.h).
  std::string profiles_file;
  std::string profile = "takt_server";
  /// Identity, permissions and governance (idl/transport/fastdds/security.h). Empty: no security.
  std::string secure_directory = {};
  /// Inspects every packet ahead of Fast DDS. Off only for tests of the effect.
  bool guard = true;
  /// Called last with the QoS, ahead of the guard's insertion: tests observe transports with it.
  std::function<void(dds::DomainParticipantQos&)> prepare = {};
  /// PacketGuard::set_on_stalled().
  std::function<void()> on_stalled = {};
};

/// Waits a little until the present readers have received what was written: ahead of the end of the writer.
inline void wait_for_acknowledgments(dds::DataWriter& writer) {
  (void)writer.wait_for_acknowledgments(DdsDuration(0, 200'000'000));
}

class Participant {
 public:
  /// The listener must outlive the participant. Throws DdsError.
  Participant(const ParticipantOptions& options, DiscoveryListener& listener);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// Writers and readers live until they are removed, or as long as the participant. `Type` is a message of
  /// idl/*.idl. Throws DdsError.
  template <typename Type>
  dds::DataWriter* create_writer(const std::string& topic, const dds::DataWriterQos& qos,
                                 dds::DataWriterListener* listener = nullptr) {
    return create_writer(topic, dds::TypeSupport(new MessageType<Type>()), qos, listener);
  }
  /// With the QoS of the topic.
  template <typename Type>
  dds::DataWriter* create_writer(const Topic<Type>& topic, const std::string& name,
                                 dds::DataWriterListener* listener = nullptr) {
    return create_writer<Type>(
        name, with_type_hash(writer_qos(default_writer_qos(), qos_of(topic)), *topic.type), listener);
  }
  template <typename Type>
  dds::DataReader* create_reader(const std::string& topic, const dds::DataReaderQos& qos,
                                 dds::DataReaderListener* listener) {
    return create_reader(topic, dds::TypeSupport(new MessageType<Type>()), qos, listener);
  }

  /// Whose samples are their bytes (BytesType), with the name and the hash of a type of idl/*.idl.
  dds::DataWriter* create_bytes_writer(const std::string& topic, const MessageInfo& type,
                                       const dds::DataWriterQos& qos, dds::DataWriterListener* listener) {
    return create_writer(topic, dds::TypeSupport(new BytesType(std::string(type.dds_type))),
                         with_type_hash(qos, type), listener);
  }
  dds::DataReader* create_bytes_reader(const std::string& topic, const MessageInfo& type,
                                       const dds::DataReaderQos& qos, dds::DataReaderListener* listener) {
    return create_reader(topic, dds::TypeSupport(new BytesType(std::string(type.dds_type))),
                         with_type_hash(qos, type), listener);
  }

  /// After their return the listener of the reader is not called. nullptr: no effect.
  void remove(dds::DataWriter* writer);
  void remove(dds::DataReader* reader);

  dds::DataWriterQos default_writer_qos() const { return publisher_->get_default_datawriter_qos(); }
  dds::DataReaderQos default_reader_qos() const { return subscriber_->get_default_datareader_qos(); }

  DdsGuid guid() const { return participant_->guid(); }
  /// Counts of the guard; nullptr without one.
  const PacketGuard* guard() const { return guard_.get(); }
  /// Of the samples for this participant; nullptr without a guard.
  UdpReceiver* receiver() { return guard_ ? &guard_->receiver() : nullptr; }

  /// After its return no listener is called.
  void silence();

 private:
  dds::DataWriter* create_writer(const std::string& topic, dds::TypeSupport type,
                                 const dds::DataWriterQos& qos, dds::DataWriterListener* listener);
  dds::DataReader* create_reader(const std::string& topic, dds::TypeSupport type,
                                 const dds::DataReaderQos& qos, dds::DataReaderListener* listener);
  dds::Topic* topic(const std::string& name, dds::TypeSupport& type);

  std::shared_ptr<PacketGuard> guard_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

}  // namespace takt
