#include "server/dds/participant.h"

#include <cstdio>
#include <memory>

#include "idl/transport/fastdds/host_local_udp.h"
#include "idl/transport/fastdds/identity_fault.h"
#include "idl/transport/fastdds/local_authority.h"
#include "idl/transport/fastdds/profiles.h"
#include "idl/transport/fastdds/security.h"
#include "idl/transport/fastdds/shared_memory_room.h"
#include "idl/transport/fastdds/thread_room.h"

namespace takt {
namespace {

dds::DomainParticipantQos this_machine_only() {
  dds::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  const auto udp = std::make_shared<ThisMachineUdp>();
  udp->sendBufferSize = 1U << 20U;
  udp->receiveBufferSize = 1U << 20U;
  qos.transport().user_transports.push_back(udp);
  // Time after which other participants drop one that died without a farewell.
  qos.wire_protocol().builtin.discovery_config.leaseDuration = DdsDuration(5, 0);
  qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod = DdsDuration(1, 0);
  return qos;
}

dds::DomainParticipantQos participant_qos(const ParticipantOptions& options, std::string& secure_directory) {
  dds::DomainParticipantQos qos;
  if (options.profiles_file.empty()) {
    qos = this_machine_only();
  } else {
    auto* factory = dds::DomainParticipantFactory::get_instance();
    if (!load_profiles(options.profiles_file)) {
      throw DdsError("The DDS profiles in '" + options.profiles_file +
                     "' cannot be read; the messages of Fast DDS beside this one say why.");
    }
    if (!is_ok(factory->get_participant_qos_from_profile(options.profile, qos))) {
      throw DdsError("The DDS profiles in '" + options.profiles_file + "' have no participant profile '" +
                     options.profile + "'.");
    }
  }
  qos.name(options.name);
  try {
    secure_directory = security_directory(options.secure_directory, "server");
    if (!secure_directory.empty()) secure(qos, secure_directory);
  } catch (const SecurityError& error) {
    throw DdsError(error.what());
  }
  return qos;
}

}  // namespace

Participant::Participant(const ParticipantOptions& options, DiscoveryListener& listener) {
  if (options.domain > 232) {
    throw DdsError("DDS domain " + std::to_string(options.domain) + " does not exist; allowed are 0 to 232.");
  }
  if (const std::string lack = lack_of_thread_room(); !lack.empty()) throw DdsError(lack);
  deliver_through_transports();
  std::string secure_directory;
  dds::DomainParticipantQos qos = participant_qos(options, secure_directory);
  if (options.prepare) options.prepare(qos);
  if (options.guard) {
    // Requests and trajectories come in fragments when they are long, but not beyond the guard's 1 MiB.
    guard_ = guard_transports(qos, options.domain, !secure_directory.empty());
    guard_->follow(listener);
    guard_->set_on_stalled(options.on_stalled);
  }
  // The participant's listener hears of discovery only; the data goes to the listeners of the readers.
  participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      options.domain, qos, &listener, dds::StatusMask::none());
  if (guard_) guard_->begin();
  if (participant_ == nullptr && !secure_directory.empty())
    throw DdsError(refused_identity(secure_directory, options.domain));
  if (participant_ == nullptr) {
    throw DdsError("DDS refused a participant on domain " + std::to_string(options.domain) +
                   ": another one may occupy its ports, or no network interface allows it.");
  }
  if (!reserve_shared_memory())
    std::fputs("takt-server: note: /dev/shm has become full; the server may end when it writes there.\n",
               stderr);
  publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
    throw DdsError("DDS refused a publisher or a subscriber.");
  }
}

Participant::~Participant() {
  silence();
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

void Participant::remove(dds::DataWriter* writer) {
  if (writer == nullptr) return;
  dds::Topic* topic = writer->get_topic();
  (void)publisher_->delete_datawriter(writer);
  (void)participant_->delete_topic(topic);  // refused while another end uses it
}

void Participant::remove(dds::DataReader* reader) {
  if (reader == nullptr) return;
  const dds::TopicDescription* topic = reader->get_topicdescription();
  reader->set_listener(nullptr);
  (void)subscriber_->delete_datareader(reader);
  (void)participant_->delete_topic(
      dynamic_cast<const dds::Topic*>(topic));  // refused while another end uses it
}

void Participant::silence() {
  participant_->set_listener(nullptr);
  std::vector<dds::DataReader*> readers;
  subscriber_->get_datareaders(readers);
  for (auto* reader : readers) reader->set_listener(nullptr);
}

dds::Topic* Participant::topic(const std::string& name, dds::TypeSupport& type) {
  if (auto* known = participant_->lookup_topicdescription(name)) return dynamic_cast<dds::Topic*>(known);
  if (!is_ok(type.register_type(participant_))) {
    throw DdsError("DDS refused the type '" + type.get_type_name() + "'.");
  }
  dds::Topic* created = participant_->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  if (created == nullptr) throw DdsError("DDS refused the topic '" + name + "'.");
  return created;
}

dds::DataWriter* Participant::create_writer(const std::string& name, dds::TypeSupport type,
                                            const dds::DataWriterQos& qos,
                                            dds::DataWriterListener* listener) {
  auto* writer = publisher_->create_datawriter(
      topic(name, type), qos, listener,
      listener == nullptr ? dds::StatusMask::none() : dds::StatusMask::publication_matched());
  if (writer == nullptr)
    throw DdsError("DDS refused a writer of the topic '" + name +
                   "' (with --secure: is the identity one of a server?).");
  return writer;
}

dds::DataReader* Participant::create_reader(const std::string& name, dds::TypeSupport type,
                                            const dds::DataReaderQos& qos,
                                            dds::DataReaderListener* listener) {
  auto* reader = subscriber_->create_datareader(topic(name, type), qos, listener);
  if (reader == nullptr) throw DdsError("DDS refused a reader of the topic '" + name + "'.");
  return reader;
}

}  // namespace takt
