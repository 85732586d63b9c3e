#include "server/dds/ros_services.h"

#include <algorithm>
#include <set>
#include <utility>

#include "ros2_service_msgs.h"
#include "server/dds/ros_service_messages.h"
#include "server/runtime/monotonic_clock.h"
#include "server/runtime/requests/request_text.h"

namespace takt {

namespace {

constexpr std::int64_t kLongestWait_ns = 1'000'000'000;

/// Identity of a request for rmw_fastrtps: its own sequence number, and the reader that waits for the reply.
rtps::SampleIdentity caller_of(const dds::SampleInfo& info) {
  rtps::SampleIdentity caller = info.sample_identity;
  const DdsGuid& reader = info.related_sample_identity.writer_guid();
  if (reader != DdsGuid::unknown()) caller.writer_guid(reader);
  return caller;
}

}  // namespace

/// DDS may discover a caller's reader of replies after its request; the reply then waits.
class RosServices::Service : public dds::DataReaderListener, public dds::DataWriterListener {
 public:
  explicit Service(RosServices& services) : services_(services) {}
  virtual void write(const Call& call, const ControlReply& reply) = 0;

  bool reaches(const rtps::SampleIdentity& caller) {
    const std::lock_guard lock(mutex_);
    return std::any_of(readers_.begin(), readers_.end(), [&](const DdsGuid& reader) {
      return reader == caller.writer_guid() || reader.guidPrefix == caller.writer_guid().guidPrefix;
    });
  }

 protected:
  void on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& status) override {
    const std::lock_guard lock(mutex_);
    const DdsGuid reader = guid_of(status.last_subscription_handle);
    if (status.current_count_change > 0) {
      readers_.insert(reader);
    } else {
      readers_.erase(reader);
    }
  }

  void received(const dds::SampleInfo& info, ros::Question question) {
    Call call{this, caller_of(info), {}};
    if (auto* asked = std::get_if<ros::Asked>(&question)) {
      call.note = std::move(asked->note);
      if (std::string fault = find_text_fault(asked->request); !fault.empty())
        return services_.answer(std::move(call), {0, ControlResult::failed, std::move(fault)});
      services_.submit(std::move(call), std::move(asked->request));
    } else {
      auto& refusal = std::get<Refusal>(question);
      services_.answer(std::move(call), {0, refusal.result, std::move(refusal.message)});
    }
  }

  RosServices& services_;
  dds::DataWriter* writer_ = nullptr;

 private:
  std::mutex mutex_;
  std::set<DdsGuid> readers_;  // guarded by mutex_
};

template <typename RequestType, typename ResponseType>
class RosServices::TypedService final : public RosServices::Service {
 public:
  TypedService(RosServices& services, Participant& participant, const std::string& name) : Service(services) {
    constexpr QosPolicy policy = qos_of(TopicQos::control);
    writer_ = participant.create_writer<ResponseType>(
        "rr/" + name + "Reply", writer_qos(participant.default_writer_qos(), policy), this);
    participant.create_reader<RequestType>(
        "rq/" + name + "Request", service_reader_qos(participant.default_reader_qos(), policy), this);
  }

  void on_data_available(dds::DataReader* reader) override {
    RequestType message;
    dds::SampleInfo info;
    while (is_ok(reader->take_next_sample(&message, &info))) {
      if (info.valid_data) received(info, ros::ask(message));
    }
  }

  void write(const Call& call, const ControlReply& reply) override {
    ResponseType message;
    ros::respond(reply, call.note, message);
    rtps::WriteParams params;
    params.related_sample_identity(call.caller);
    // A reply that DDS refuses is lost; the caller's time-out reports it.
    (void)written(*writer_, message, params);
  }
};

RosServices::RosServices(CellHost& host) : host_(host) {}
RosServices::~RosServices() = default;

void RosServices::serve(Participant& participant, const std::string& cell) {
  using namespace ros::srv;
  const auto add = [&]<typename Request, typename Response>(const char* name) {
    services_.push_back(
        std::make_unique<TypedService<Request, Response>>(*this, participant, cell + "/" + name));
  };
#define TAKT_SERVICE(Type, name, request) add.template operator()<Type##_Request, Type##_Response>(name);
  TAKT_FOR_EACH_ROS_SERVICE(TAKT_SERVICE)
  TAKT_SERVICE(takt_msgs::srv::Control, "control", )
#undef TAKT_SERVICE
}

void RosServices::submit(Call call, ControlRequest request) {
  {
    const std::lock_guard lock(mutex_);
    request.id = newest_id_++;
    calls_.emplace(request.id, std::move(call));
    if (calls_.size() > kRemembered) calls_.erase(calls_.begin());
  }
  host_.submit(request);
}

void RosServices::answer(Call call, ControlReply reply) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({std::move(call), std::move(reply), monotonic_now_ns()});
  }
  host_.outbound().news.post();
}

void RosServices::write_replies(std::span<const ControlReply> replies) {
  const std::int64_t now = monotonic_now_ns();
  std::vector<Waiting> due;
  {
    const std::lock_guard lock(mutex_);
    for (const ControlReply& reply : replies) {
      const auto call = calls_.find(reply.id);
      if (call == calls_.end()) continue;
      waiting_.push_back({std::move(call->second), reply, now});
      calls_.erase(call);
    }
    std::vector<Waiting> later;
    for (Waiting& waiting : waiting_) {
      const bool now_or_never =
          waiting.call.service->reaches(waiting.call.caller) || now - waiting.since_ns > kLongestWait_ns;
      (now_or_never ? due : later).push_back(std::move(waiting));
    }
    waiting_ = std::move(later);
    if (waiting_.size() > kRemembered)
      waiting_.erase(waiting_.begin(), waiting_.end() - static_cast<std::ptrdiff_t>(kRemembered));
  }
  for (Waiting& waiting : due) waiting.call.service->write(waiting.call, sanitize(std::move(waiting.reply)));
}

}  // namespace takt
