#include "client_lib/dds_link.h"

#include <pthread.h>

#include <atomic>
#include <set>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/participant_numbers.h"
#include "idl/transport/fastdds/host_local_udp.h"
#include "idl/transport/fastdds/identity_fault.h"
#include "idl/transport/fastdds/local_authority.h"
#include "idl/transport/fastdds/profiles.h"
#include "idl/transport/fastdds/security.h"
#include "idl/transport/fastdds/shared_memory_room.h"
#include "idl/transport/fastdds/thread_room.h"

namespace takt::client {
namespace {

/// Times that this process and those it comes from were forked. A look at it costs no system call, as getpid() does.
std::atomic<int> forks{0};

int forks_so_far() {
  static const int registered = pthread_atfork(nullptr, nullptr, [] { ++forks; });
  (void)registered;
  return forks.load(std::memory_order_relaxed);
}

/// A description with its meshes is large, and lost fragments of it have to be asked for one by one.
GuardLimits guard_limits() {
  GuardLimits limits;
  limits.largest_sample_bytes = 256U << 20U;
  limits.most_fragments_joined = FragmentAssembly::kMaxSentAgain;
  return limits;
}

[[noreturn]] void fail(const std::string& sentence) {
  throw ClientError(ClientError::Kind::transport, sentence);
}

dds::DomainParticipantQos participant_qos(const std::string& name, const LinkProfile& profile) {
  auto* factory = dds::DomainParticipantFactory::get_instance();
  dds::DomainParticipantQos qos;
  if (!profile.profiles_file.empty()) {
    if (!load_profiles(profile.profiles_file))
      fail("The DDS profiles file '" + profile.profiles_file + "' cannot be read as Fast DDS profiles.");
    if (!is_ok(factory->get_participant_qos_from_profile(profile.profile, qos)))
      fail("The DDS profiles file '" + profile.profiles_file + "' has no participant profile named '" +
           profile.profile + "'.");
    qos.name(name);
    return qos;
  }
  if (profile.profile != LinkProfile::kDefaultProfile)
    throw ClientError(ClientError::Kind::invalid, "The DDS profile '" + profile.profile +
                                                      "' is asked for, but no profiles file is named.");
  qos.name(name);
  // This machine only.
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<ThisMachineUdp>();
  // A description of megabytes comes as a burst of fragments.
  udp->receiveBufferSize = 4U << 20U;
  qos.transport().user_transports.push_back(udp);
  // A client that dies unannounced is forgotten soon, so that another may take over its robots.
  qos.wire_protocol().builtin.discovery_config.leaseDuration = DdsDuration(5, 0);
  qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod = DdsDuration(1, 0);
  return qos;
}

/// Others in this process may have taken one: then Fast DDS 2.9.1 fails to make ours, and deletes the one
/// that it finds under its GUID, which is theirs.
int draw_number(int domain) {
  std::set<int> theirs;
  for (const auto* other : dds::DomainParticipantFactory::get_instance()->lookup_participants(
           static_cast<dds::DomainId_t>(domain))) {
    const auto& prefix = other->guid().guidPrefix.value;
    theirs.insert(prefix[8] | prefix[9] << 8);
  }
  std::vector<int> unfit;
  int number = ParticipantNumbers::of_process().draw();
  for (; theirs.contains(number); number = ParticipantNumbers::of_process().draw()) unfit.push_back(number);
  for (const int drawn : unfit) ParticipantNumbers::of_process().give_back(drawn);
  return number;
}

}  // namespace

GuidPrefix participant_of(const dds::InstanceHandle_t& handle) {
  return guid_of(handle).guidPrefix;
}

Link::Link(int domain, const std::string& name, const LinkProfile& profile, DiscoveryListener* listener)
    : forks_(forks_so_far()) {
  if (domain < 0 || domain > 232)
    throw ClientError(ClientError::Kind::invalid,
                      "DDS domain " + std::to_string(domain) + " does not exist; allowed are 0 to 232.");
  if (const std::string lack = lack_of_thread_room(); !lack.empty()) fail(lack);
  deliver_through_transports();
  dds::DomainParticipantQos qos = participant_qos(name, profile);
  std::string directory;
  try {
    directory = security_directory(profile.secure_directory, "controller");
    if (!directory.empty()) secure(qos, directory);
  } catch (const SecurityError& error) {
    fail(error.what());
  }
  const bool secured = !directory.empty();
  guard_ = guard_transports(qos, static_cast<std::uint32_t>(domain), secured, guard_limits());
  if (listener == nullptr) listener = &no_listener_;
  guard_->follow(*listener);
  auto* factory = dds::DomainParticipantFactory::get_instance();
  // A number can be taken by another process. Fast DDS 2.9.1 never frees one whose participant it failed to
  // create, so such a number is not given back, and another one is drawn.
  constexpr int kAttempts = 5;
  for (int attempt = 0; attempt < (secured ? 1 : kAttempts) && participant_ == nullptr; ++attempt) {
    if (profile.profiles_file.empty()) number_ = qos.wire_protocol().participant_id = draw_number(domain);
    // Discovery only: data goes to the listeners of readers and writers.
    participant_ = factory->create_participant(static_cast<dds::DomainId_t>(domain), qos, listener,
                                               dds::StatusMask::none());
  }
  guard_->begin();
  if (participant_ == nullptr && secured)
    fail(refused_identity(directory, static_cast<std::uint32_t>(domain)));
  if (participant_ == nullptr)
    fail("DDS cannot start on domain " + std::to_string(domain) +
         " (is /dev/shm writable, are the UDP ports of the domain free?).");
  static_cast<void>(reserve_shared_memory());
  publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    participant_->delete_contained_entities();
    factory->delete_participant(participant_);
    fail("DDS refused a publisher or subscriber on domain " + std::to_string(domain) + ".");
  }
}

bool Link::is_of_this_process() const {
  return forks_so_far() == forks_;
}

Link::~Link() {
  if (!is_of_this_process()) return;
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  ParticipantNumbers::of_process().give_back(number_);
}

dds::Topic* Link::topic(const std::string& name, dds::TypeSupport type) {
  if (auto* known = participant_->lookup_topicdescription(name)) return static_cast<dds::Topic*>(known);
  if (!is_ok(participant_->register_type(type))) fail("DDS refused the type '" + type.get_type_name() + "'.");
  dds::Topic* created = participant_->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  if (created == nullptr) fail("DDS refused the topic '" + name + "'.");
  return created;
}

dds::DataReader* Link::create_reader(const std::string& name, dds::TypeSupport type,
                                     const dds::DataReaderQos& qos, dds::DataReaderListener* listener) {
  auto* reader = subscriber_->create_datareader(topic(name, type), qos, listener);
  if (reader == nullptr) fail("DDS refused a reader of topic '" + name + "'.");
  return reader;
}

void Link::remove(dds::DataReader* reader) {
  reader->set_listener(nullptr);
  subscriber_->delete_datareader(reader);
}

dds::DataWriter* Link::create_writer(const std::string& name, dds::TypeSupport type,
                                     const dds::DataWriterQos& qos, dds::DataWriterListener* listener) {
  auto* writer = publisher_->create_datawriter(topic(name, type), qos, listener);
  if (writer == nullptr)
    fail("DDS refused a writer of topic '" + name +
         "' (does the security profile of this client allow it?).");
  return writer;
}

}  // namespace takt::client
