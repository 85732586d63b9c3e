#include "server/dds/ros_services.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "idl/common/cdr.h"
#include "ros2_service_msgs.h"
#include "server/runtime/monotonic_clock.h"
#include "server/runtime/requests/request_text.h"

namespace takt {

namespace {

constexpr std::int64_t kLongestWait_ns = 1'000'000'000;

}  // namespace

/// Its requests are read on a thread of DDS, its replies written on the publishing thread.
class RosServices::Service {
 public:
  explicit Service(RosServices& services) : services_(services) {}
  virtual ~Service() = default;
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  bool reaches(const RosEndpoint::Caller& caller) { return endpoint_->reaches(caller); }
  /// The reply describes the newest instant.
  virtual bool needs_instant() const { return false; }
  void write(const Call& call, const ControlReply& reply, const ros::Instant& now) {
    endpoint_->write(call.caller, encoded(call, reply, now));
  }

 protected:
  void listen(Participant& participant, const std::string& name, const MessageInfo& request,
              const MessageInfo& response) {
    const auto on_request = [this](const RosEndpoint::Caller& caller, std::span<const std::uint8_t> sample) {
      received(caller, sample);
    };
    endpoint_.emplace(participant, name, request, response, on_request,
                      [this] { services_.host_.outbound().news.post(); });
  }
  /// std::nullopt where the bytes are no request.
  virtual std::optional<ros::Question> question(std::span<const std::uint8_t> sample) const = 0;
  virtual std::string encoded(const Call& call, const ControlReply& reply, const ros::Instant& now) const = 0;

  virtual void received(const RosEndpoint::Caller& caller, std::span<const std::uint8_t> sample) {
    std::optional<ros::Question> found = question(sample);
    if (!found) return;
    Call call{this, caller, {}, nullptr};
    if (auto* asked = std::get_if<ros::Asked>(&*found)) {
      call.note = std::move(asked->note);
      if (std::string fault = find_text_fault(asked->request); !fault.empty())
        return services_.answer(std::move(call), {0, ControlResult::failed, std::move(fault)});
      services_.submit(std::move(call), std::move(asked->request));
    } else {
      auto& refusal = std::get<Refusal>(*found);
      services_.answer(std::move(call), {0, refusal.result, std::move(refusal.message)});
    }
  }

  RosServices& services_;

 private:
  std::optional<RosEndpoint> endpoint_;
};

template <typename RequestType, typename ResponseType>
class RosServices::TypedService final : public RosServices::Service {
 public:
  TypedService(RosServices& services, Participant& participant, const std::string& name) : Service(services) {
    listen(participant, name, message_info<RequestType>(), message_info<ResponseType>());
  }

  /// An exception would go through the threads of DDS and end the process.
  std::optional<ros::Question> question(std::span<const std::uint8_t> sample) const override {
    try {
      RequestType message;
      if (!cdr::read(sample, message)) return std::nullopt;
      return ros::ask(message);
    } catch (const std::exception&) {
      return std::nullopt;
    }
  }

  std::string encoded(const Call& call, const ControlReply& reply, const ros::Instant&) const override {
    ResponseType message;
    ros::respond(reply, call.note, message);
    std::string bytes;
    (void)cdr::write(message, bytes);
    return bytes;
  }
};

/// A service that the publishing thread answers from the newest instant.
template <typename RequestType, typename ResponseType>
class RosServices::InstantService final : public RosServices::Service {
 public:
  InstantService(RosServices& services, Participant& participant, const std::string& name)
      : Service(services) {
    listen(participant, name, message_info<RequestType>(), message_info<ResponseType>());
  }
  bool needs_instant() const override { return true; }

 private:
  std::optional<ros::Question> question(std::span<const std::uint8_t>) const override { return std::nullopt; }
  void received(const RosEndpoint::Caller& caller, std::span<const std::uint8_t> sample) override {
    services_.answer({this, caller, std::string(reinterpret_cast<const char*>(sample.data()), sample.size())},
                     {});
  }
  std::string encoded(const Call& call, const ControlReply&, const ros::Instant& now) const override {
    RequestType request;
    ResponseType response;
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(call.note.data());
    if (cdr::read({bytes, call.note.size()}, request)) {
      ros::answer(now, request, response);
    } else {
      response.result.error_message = "The request cannot be read.";
      response.result.result = static_cast<std::uint8_t>(ControlResult::failed);
    }
    std::string encoded;
    (void)cdr::write(response, encoded);
    return encoded;
  }
};

/// Requests of one call, one after the other.
struct RosServices::Batch {
  Service* service = nullptr;
  RosEndpoint::Caller caller;
  std::vector<ros::Question> questions;
  std::vector<ControlReply> replies;  ///< to the first questions
};

class RosServices::SpawnEntities final : public RosServices::Service {
 public:
  using Request = ros::srv::SpawnEntities_Request;
  using Response = ros::srv::SpawnEntities_Response;

  SpawnEntities(RosServices& services, Participant& participant, const std::string& name)
      : Service(services) {
    listen(participant, name, message_info<Request>(), message_info<Response>());
  }

 private:
  std::optional<ros::Question> question(std::span<const std::uint8_t>) const override { return std::nullopt; }
  void received(const RosEndpoint::Caller& caller, std::span<const std::uint8_t> sample) override {
    try {
      Request request;
      if (!cdr::read(sample, request)) return;
      auto questions = ros::ask(request);
      if (auto* refusal = std::get_if<Refusal>(&questions))
        return services_.answer({this, caller, {}, nullptr},
                                {0, refusal->result, std::move(refusal->message)});
      auto batch = std::make_shared<Batch>();
      batch->service = this;
      batch->caller = caller;
      batch->questions = std::get<0>(std::move(questions));
      services_.begin(std::move(batch));
    } catch (const std::exception&) {  // it would end the process; the caller's time-out reports it
      return;
    }
  }
  std::string encoded(const Call& call, const ControlReply& reply, const ros::Instant&) const override {
    Response response;
    if (call.batch) {
      ros::respond(call.batch->replies, response);
    } else {
      response.result = ros::result_of(reply);
    }
    std::string bytes;
    (void)cdr::write(response, bytes);
    return bytes;
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
  const auto add_instant = [&]<typename Request, typename Response>(const char* name) {
    services_.push_back(
        std::make_unique<InstantService<Request, Response>>(*this, participant, cell + "/" + name));
  };
  add.operator()<GetNamedPoseBounds_Request, GetNamedPoseBounds_Response>("get_named_pose_bounds");
  services_.push_back(std::make_unique<SpawnEntities>(*this, participant, cell + "/spawn_entities"));
  add_instant.operator()<GetEntitiesStates_Request, GetEntitiesStates_Response>("get_entities_states");
  add_instant.operator()<GetEntityInfo_Request, GetEntityInfo_Response>("get_entity_info");
  add_instant.operator()<GetEntityBounds_Request, GetEntityBounds_Response>("get_entity_bounds");
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

void RosServices::begin(std::shared_ptr<Batch> batch) {
  {
    const std::lock_guard lock(mutex_);
    go_on(batch);
  }
  host_.outbound().news.post();
}

void RosServices::go_on(const std::shared_ptr<Batch>& batch) {
  while (batch->replies.size() < batch->questions.size()) {
    ros::Question& question = batch->questions[batch->replies.size()];
    if (auto* refusal = std::get_if<Refusal>(&question)) {
      batch->replies.push_back({0, refusal->result, refusal->message});
      continue;
    }
    ControlRequest request = std::move(std::get<ros::Asked>(question).request);
    if (std::string fault = find_text_fault(request); !fault.empty()) {
      batch->replies.push_back({0, ControlResult::failed, std::move(fault)});
      continue;
    }
    request.id = newest_id_++;
    calls_.emplace(request.id, Call{batch->service, batch->caller, {}, batch});
    of_batches_.push_back(std::move(request));
    return;
  }
  waiting_.push_back({Call{batch->service, batch->caller, {}, batch}, {}, monotonic_now_ns()});
}

void RosServices::submit_following() {
  std::vector<ControlRequest> requests;
  {
    const std::lock_guard lock(mutex_);
    requests.swap(of_batches_);
  }
  for (const ControlRequest& request : requests) host_.submit(request);
}

void RosServices::answer(Call call, ControlReply reply) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({std::move(call), std::move(reply), monotonic_now_ns()});
  }
  host_.outbound().news.post();
}

bool RosServices::replies_wait() {
  const std::lock_guard lock(mutex_);
  return !waiting_.empty();
}

void RosServices::write_replies(std::span<const ControlReply> replies, const ros::Instant* present) {
  const std::int64_t now = monotonic_now_ns();
  std::vector<Waiting> due;
  {
    const std::lock_guard lock(mutex_);
    for (const ControlReply& reply : replies) {
      const auto call = calls_.find(reply.id);
      if (call == calls_.end()) continue;
      const Call found = std::move(call->second);
      calls_.erase(call);
      if (found.batch) {
        found.batch->replies.push_back(sanitize(reply));
        go_on(found.batch);
      } else {
        waiting_.push_back({found, reply, now});
      }
    }
    std::vector<Waiting> later;
    for (Waiting& waiting : waiting_) {
      Service& service = *waiting.call.service;
      const bool can_answer =
          service.reaches(waiting.call.caller) && (present != nullptr || !service.needs_instant());
      const bool now_or_never = can_answer || now - waiting.since_ns > kLongestWait_ns;
      (now_or_never ? due : later).push_back(std::move(waiting));
    }
    waiting_ = std::move(later);
    if (waiting_.size() > kRemembered)
      waiting_.erase(waiting_.begin(), waiting_.end() - static_cast<std::ptrdiff_t>(kRemembered));
  }
  if (due.empty()) return;
  ros::Instant instant = present != nullptr ? *present : ros::Instant{};
  instant.infos = host_.entity_infos();
  if (!instant.infos) instant.infos = std::make_shared<const EntityInfos>();
  for (Waiting& waiting : due)
    waiting.call.service->write(waiting.call, sanitize(std::move(waiting.reply)), instant);
}

}  // namespace takt
