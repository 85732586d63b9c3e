#pragma once
// Both ends of the benchmarks over plain Fast DDS.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "idl/transport/fastdds/topic_qos.h"

namespace takt::bench {

/// A participant with the transports that Fast DDS has by default, or UDP alone.
class RawNode {
 public:
  RawNode(std::uint32_t domain, bool udp) {
    dds::DomainParticipantQos qos;
    if (udp) {
      qos.transport().use_builtin_transports = false;
      qos.transport().user_transports.push_back(std::make_shared<transports::UDPv4TransportDescriptor>());
    }
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  template <typename Message>
  dds::DataWriter* writer(const std::string& name, const QosPolicy& policy) {
    return publisher_->create_datawriter(topic<Message>(name),
                                         writer_qos(publisher_->get_default_datawriter_qos(), policy));
  }
  template <typename Message>
  dds::DataReader* reader(const std::string& name, const QosPolicy& policy,
                          dds::DataReaderListener& listener) {
    return subscriber_->create_datareader(
        topic<Message>(name), reader_qos(subscriber_->get_default_datareader_qos(), policy), &listener);
  }

 private:
  template <typename Message>
  dds::Topic* topic(const std::string& name) {
    dds::TypeSupport type(new MessageType<Message>());
    (void)type.register_type(participant_);
    return participant_->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

/// The listener takes a sample and wakes the thread that waits for it, as any client does.
template <typename Message>
class Newest final : public dds::DataReaderListener {
 public:
  void on_data_available(dds::DataReader* reader) override {
    const std::lock_guard lock(mutex_);
    dds::SampleInfo info;
    while (is_ok(reader->take_next_sample(&message_, &info))) {
      if (!info.valid_data) continue;
      ++count_;
      arrived_.notify_all();
    }
  }
  /// False after this time of silence.
  bool wait_beyond(std::uint64_t count, std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, limit, [&] { return count_ > count; });
  }
  /// Of samples so far.
  std::uint64_t count() {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  /// `read(message)` of the newest one.
  template <typename Read>
  auto look(const Read& read) {
    const std::lock_guard lock(mutex_);
    return read(message_);
  }

 private:
  Message message_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::uint64_t count_ = 0;
};

}  // namespace takt::bench
