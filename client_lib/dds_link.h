#pragma once
// The Fast DDS entities of a client: participant, readers, writers, with the QoS of the service.
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_lib/sample_pool.h"
#include "idl/transport/fastdds/topic_qos.h"
#include "idl/transport/rtps_guard/guard_transport.h"

namespace takt::client {

namespace dds = takt::dds;
using GuidPrefix = rtps::GuidPrefix_t;

/// Which participant an entity or a sample belongs to: the identity of one run of a server.
GuidPrefix participant_of(const dds::InstanceHandle_t& handle);

/// Discovery and identity of a participant.
struct LinkProfile {
  std::string profiles_file;     ///< Fast DDS profiles (XML); empty: this machine only
  std::string secure_directory;  ///< idl/transport/fastdds/security.h; empty: no security
  std::string profile = kDefaultProfile;
  static constexpr const char* kDefaultProfile = "takt_client";
};

/// One participant and everything below it. Throws ClientError (transport) when an entity cannot be made.
class Link {
 public:
  Link(int domain, const std::string& name, const LinkProfile& profile,
       DiscoveryListener* listener = nullptr);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  dds::DataWriterQos default_writer_qos() const { return publisher_->get_default_datawriter_qos(); }
  dds::DataReaderQos default_reader_qos() const { return subscriber_->get_default_datareader_qos(); }
  /// With the QoS of the topic; `name` without "rt/".
  template <typename Type>
  dds::DataReader* create_reader(const Topic<Type>& topic, const std::string& name,
                                 dds::DataReaderListener* listener) {
    return create_reader("rt/" + name, dds::TypeSupport(new MessageType<Type>()),
                         reader_qos(default_reader_qos(), qos_of(topic)), listener);
  }
  dds::DataReader* create_reader(const std::string& topic, dds::TypeSupport type,
                                 const dds::DataReaderQos& qos, dds::DataReaderListener* listener);
  dds::DataWriter* create_writer(const std::string& topic, dds::TypeSupport type,
                                 const dds::DataWriterQos& qos, dds::DataWriterListener* listener);
  void remove(dds::DataReader* reader);
  /// False in the child process after fork(), where no function of the link works. The child's destructor
  /// leaves the DDS entities alone, since they belong to the parent.
  bool is_of_this_process() const;
  /// The last time at which this process continued after a stop so long that servers may have dropped it. DDS then
  /// discovers the servers again, which takes seconds. The clock's epoch means never.
  std::chrono::steady_clock::time_point returned() const { return guard_->returned(); }
  const PacketGuard& guard() const { return *guard_; }
  UdpReceiver& receiver() { return guard_->receiver(); }

 private:
  const int forks_;  ///< of this process when the link was made
  dds::Topic* topic(const std::string& name, dds::TypeSupport type);
  int number_ = -1;  ///< of the participant, see dds_link.cpp
  std::shared_ptr<PacketGuard> guard_;
  DiscoveryListener no_listener_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

/// Calls a function for every sample and for every change of the matched writers, in threads of DDS. `Kept` is the
/// message or what adds to it.
template <Message Type, std::derived_from<Type> Kept>
class KeptSampleListener : public dds::DataReaderListener {
 public:
  using OnSample = std::function<void(std::shared_ptr<Kept>, const GuidPrefix& sender)>;
  using OnMatch = std::function<void(const GuidPrefix& writer, bool matched)>;
  KeptSampleListener(SamplePool<Type, Kept> pool, OnSample on_sample, OnMatch on_match = {})
      : pool_(std::move(pool)), on_sample_(std::move(on_sample)), on_match_(std::move(on_match)) {}

  void on_data_available(dds::DataReader* reader) override {
    dds::SampleInfo info;
    for (auto sample = pool_.take();
         is_ok(reader->take_next_sample(static_cast<Type*>(sample.get()), &info));) {
      if (!info.valid_data) continue;
      on_sample_(std::move(sample), participant_of(info.publication_handle));
      sample = pool_.take();
    }
  }
  void on_subscription_matched(dds::DataReader*, const dds::SubscriptionMatchedStatus& status) override {
    if (on_match_) on_match_(participant_of(status.last_publication_handle), status.current_count_change > 0);
  }

 private:
  SamplePool<Type, Kept> pool_;
  OnSample on_sample_;
  OnMatch on_match_;
};

/// The same for samples that are looked at once.
template <Message Type>
class ReaderListener : public KeptSampleListener<Type, Type> {
 public:
  using OnSample = std::function<void(Type&&, const GuidPrefix& sender)>;
  explicit ReaderListener(OnSample on_sample, typename KeptSampleListener<Type, Type>::OnMatch on_match = {})
      : KeptSampleListener<Type, Type>(
            SamplePool<Type>(0),
            [on_sample = std::move(on_sample)](std::shared_ptr<Type> sample, const GuidPrefix& sender) {
              on_sample(std::move(*sample), sender);
            },
            std::move(on_match)) {}
};

/// Reports changes of a writer's matched readers, and the QoS policy by which DDS rejects a reader.
class WriterListener : public dds::DataWriterListener {
 public:
  using OnMatch = std::function<void(const dds::PublicationMatchedStatus&)>;
  WriterListener(OnMatch on_match, std::function<void(int policy_id)> on_incompatible)
      : on_match_(std::move(on_match)), on_incompatible_(std::move(on_incompatible)) {}
  void on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& status) override {
    on_match_(status);
  }
  void on_offered_incompatible_qos(dds::DataWriter*,
                                   const dds::OfferedIncompatibleQosStatus& status) override {
    on_incompatible_(static_cast<int>(status.last_policy_id));
  }

 private:
  OnMatch on_match_;
  std::function<void(int)> on_incompatible_;
};

}  // namespace takt::client
