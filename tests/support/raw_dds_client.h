#pragma once
// DDS endpoints of a third party: plain Fast DDS without takt's own client or adapter code (fastdds.h only
// has names for the differences between the majors of Fast DDS).
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "idl/transport/fastdds/fastdds.h"
#include "ros2_msgs.h"
#include "takt_msgs.h"

namespace takt::test {

namespace fdds = takt::dds;

/// Samples, in the order of arrival, and a way to wait for them. The limit only keeps a broken server from
/// hanging the test.
template <typename Message>
class Inbox final : public fdds::DataReaderListener {
 public:
  void on_data_available(fdds::DataReader* reader) override {
    Message message;
    fdds::SampleInfo info;
    while (is_ok(reader->take_next_sample(&message, &info))) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(mutex_);
      messages_.push_back(message);
      arrived_.notify_all();
    }
  }
  bool wait_until(const std::function<bool(const std::vector<Message>&)>& condition) {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, std::chrono::seconds(60), [&] { return condition(messages_); });
  }
  /// For discovery, if the other side cannot report that it is ready: the caller tries again.
  bool wait_briefly(const std::function<bool(const std::vector<Message>&)>& condition) {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, std::chrono::milliseconds(100), [&] { return condition(messages_); });
  }
  bool wait_for(const std::function<bool(const Message&)>& wanted, Message* found = nullptr) {
    return wait_until([&](const std::vector<Message>& messages) {
      for (const Message& message : messages) {
        if (!wanted(message)) continue;
        if (found != nullptr) *found = message;
        return true;
      }
      return false;
    });
  }
  std::vector<Message> messages() {
    const std::lock_guard lock(mutex_);
    return messages_;
  }
  /// For runs so long that all messages do not fit.
  void forget() {
    const std::lock_guard lock(mutex_);
    messages_.clear();
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<Message> messages_;
};

class MatchCounter final : public fdds::DataWriterListener {
 public:
  void on_publication_matched(fdds::DataWriter*, const fdds::PublicationMatchedStatus& status) override {
    const std::lock_guard lock(mutex_);
    matched_ = status.current_count;
    changed_.notify_all();
  }
  bool wait_for(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return matched_ >= count; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int matched_ = 0;
};

struct RawWriter {
  fdds::DataWriter* writer = nullptr;
  std::shared_ptr<MatchCounter> matches = std::make_shared<MatchCounter>();
  std::string guid() const {
    std::ostringstream text;
    text << writer->guid();
    return text.str();
  }
};

class RawDdsClient {
 public:
  /// A short lease, so that a client that was killed is missed soon. `number`: its ports and the end of its
  /// GUID follow from it; -1: DDS chooses.
  explicit RawDdsClient(std::uint32_t domain, std::int32_t lease_s = 2, std::int32_t number = -1) {
    // Samples inside one process must take the same way as those between processes.
    deliver_through_transports();

    // Transports as Fast DDS has them by default, which is how ROS 2 tools come.
    fdds::DomainParticipantQos qos;
    qos.wire_protocol().builtin.discovery_config.leaseDuration = DdsDuration(lease_s, 0);
    qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod =
        DdsDuration(0, 500'000'000);
    qos.wire_protocol().participant_id = number;
    participant_ = fdds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    if (participant_ == nullptr) throw std::runtime_error("no participant");
    publisher_ = participant_->create_publisher(fdds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(fdds::SUBSCRIBER_QOS_DEFAULT);
  }
  ~RawDdsClient() {
    participant_->delete_contained_entities();
    fdds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  RawDdsClient(const RawDdsClient&) = delete;
  RawDdsClient& operator=(const RawDdsClient&) = delete;

  template <typename Type>
  std::shared_ptr<Inbox<Type>> read(const std::string& topic_name, bool reliable, bool late_joiner,
                                    int depth) {
    auto inbox = std::make_shared<Inbox<Type>>();
    listeners_.push_back(inbox);
    fdds::DataReaderQos qos = subscriber_->get_default_datareader_qos();
    qos.reliability().kind = reliable ? fdds::RELIABLE_RELIABILITY_QOS : fdds::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind =
        late_joiner ? fdds::TRANSIENT_LOCAL_DURABILITY_QOS : fdds::VOLATILE_DURABILITY_QOS;
    qos.history().depth = depth;
    qos.endpoint().history_memory_policy = kGrowingMemory;
    if (subscriber_->create_datareader(topic<Type>(topic_name), qos, inbox.get()) == nullptr) {
      throw std::runtime_error("no reader of " + topic_name);
    }
    return inbox;
  }

  /// With a listener of the test's own, which must outlive this.
  template <typename Type>
  fdds::DataReader* listen(const std::string& topic_name, fdds::DataReaderListener* listener) {
    fdds::DataReaderQos qos = subscriber_->get_default_datareader_qos();
    qos.reliability().kind = fdds::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = kGrowingMemory;
    auto* reader = subscriber_->create_datareader(topic<Type>(topic_name), qos, listener);
    if (reader == nullptr) throw std::runtime_error("no reader of " + topic_name);
    return reader;
  }

  /// Shared ownership, as a stock ROS 2 publisher, or exclusive, as takt's own client.
  template <typename Type>
  RawWriter write(const std::string& topic_name, bool exclusive = false, std::uint32_t strength = 0,
                  double lease_s = 0.0) {
    fdds::DataWriterQos qos = publisher_->get_default_datawriter_qos();
    qos.reliability().kind = fdds::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;  // as ROS 2: of a burst with depth 1 the last sample alone is sure to arrive
    qos.endpoint().history_memory_policy = kGrowingMemory;
    if (exclusive) {
      qos.ownership().kind = fdds::EXCLUSIVE_OWNERSHIP_QOS;
      qos.ownership_strength().value = strength;
    }
    if (lease_s > 0.0) {
      qos.liveliness().lease_duration = DdsDuration(lease_s);
      qos.liveliness().announcement_period = DdsDuration(0.25 * lease_s);
    }
    RawWriter writer;
    listeners_.push_back(writer.matches);
    writer.writer = publisher_->create_datawriter(topic<Type>(topic_name), qos, writer.matches.get());
    if (writer.writer == nullptr) throw std::runtime_error("no writer of " + topic_name);
    return writer;
  }
  void remove(RawWriter& writer) { publisher_->delete_datawriter(writer.writer); }

 private:
  template <typename Type>
  fdds::Topic* topic(const std::string& name) {
    if (auto* known = participant_->lookup_topicdescription(name)) return dynamic_cast<fdds::Topic*>(known);
    fdds::TypeSupport type(new MessageType<Type>());
    type.register_type(participant_);
    return participant_->create_topic(name, type.get_type_name(), fdds::TOPIC_QOS_DEFAULT);
  }

  std::vector<std::shared_ptr<void>> listeners_;  // DDS may call them until the participant is gone
  fdds::DomainParticipant* participant_ = nullptr;
  fdds::Publisher* publisher_ = nullptr;
  fdds::Subscriber* subscriber_ = nullptr;
};

}  // namespace takt::test
