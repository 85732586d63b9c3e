#pragma once
// A caller of ROS 2 services as rmw_fastrtps calls: the request carries the caller's reader of replies in its
// related_sample_identity, the reply carries back that and the request's number.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>

#include "tests/support/raw_dds_client.h"
#include "tests/support/test_domain.h"

namespace takt::test {

namespace frtps = takt::rtps;

/// Waits for both directions before it asks, as ROS 2 does (wait_for_service): a reply that is sent before the reader of
/// replies knows its writer is lost.
template <typename RequestType, typename ResponseType>
class Caller final : public fdds::DataReaderListener {
 public:
  using Request = RequestType;
  using Response = ResponseType;

  Caller(RawDdsClient& dds, const std::string& name)
      : reader_(dds.listen<ResponseType>("rr/" + test_cell() + "/" + name + "Reply", this)),
        writer_(dds.write<RequestType>("rq/" + test_cell() + "/" + name + "Request")) {
    std::unique_lock lock(mutex_);
    const bool heard = arrived_.wait_for(lock, std::chrono::seconds(60), [this] { return matched_; });
    if (!heard || !writer_.matches->wait_for(1)) throw std::runtime_error("no service " + name);
  }

  std::int64_t send(Request request) {
    frtps::WriteParams params;
    params.related_sample_identity().writer_guid(reader_->guid());
    if (!takt::written(*writer_.writer, request, params)) throw std::runtime_error("not written");
    return number(params.sample_identity());
  }
  Response await(std::int64_t sent) {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_for(lock, std::chrono::seconds(60), [&] { return responses_.contains(sent); }))
      throw std::runtime_error("no reply");
    return responses_.at(sent);
  }
  Response call(const Request& request) { return await(send(request)); }
  std::size_t strangers() {
    const std::lock_guard lock(mutex_);
    return strangers_;
  }

  void on_subscription_matched(fdds::DataReader*, const fdds::SubscriptionMatchedStatus& status) override {
    const std::lock_guard lock(mutex_);
    matched_ = status.current_count > 0;
    arrived_.notify_all();
  }
  void on_data_available(fdds::DataReader* reader) override {
    Response response;
    fdds::SampleInfo info;
    while (takt::is_ok(reader->take_next_sample(&response, &info))) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(mutex_);
      if (info.related_sample_identity.writer_guid() == reader->guid()) {
        responses_[number(info.related_sample_identity)] = response;
      } else {
        ++strangers_;
      }
      arrived_.notify_all();
    }
  }

 private:
  static std::int64_t number(const frtps::SampleIdentity& identity) {
    return static_cast<std::int64_t>(identity.sequence_number().to64long());
  }

  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::int64_t, Response> responses_;
  std::size_t strangers_ = 0;
  bool matched_ = false;
  fdds::DataReader* reader_;
  RawWriter writer_;
};

}  // namespace takt::test
