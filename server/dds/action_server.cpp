#include "server/dds/action_server.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "idl/common/stamp.h"
#include "server/runtime/monotonic_clock.h"

namespace takt {
namespace {

/// For the discovery of a caller on a busy machine.
constexpr std::int64_t kLongestReplyWait_ns = 10'000'000'000;
/// Most requests and replies of an action that wait.
constexpr std::size_t kMaxWaiting = 1000;

std::span<const std::uint8_t> sample_bytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

template <Message Type>
std::string encoded(const Type& message) {
  std::string bytes;
  (void)cdr::write(message, bytes);
  return bytes;
}

}  // namespace

ActionServer::ActionServer(Participant& participant, const std::string& name, Types types,
                           std::uint64_t& numbers, std::function<void()> news)
    : participant_(participant), types_(std::move(types)), numbers_(numbers), news_(std::move(news)) {
  using namespace action_msgs;
  try {
    const std::string base = name + "/_action/";
    // As ROS 2 offers them, with room for feedback of a free pace: each counts. A late joiner gets the whole list of states.
    constexpr QosPolicy feedback{.depth = 1000}, status{.latched = true};
    feedback_ =
        participant.create_bytes_writer("rt/" + base + "feedback", *types_.feedback,
                                        writer_qos(participant.default_writer_qos(), feedback), nullptr);
    status_ = participant.create_bytes_writer("rt/" + base + "status", message_info<msg::GoalStatusArray>(),
                                              writer_qos(participant.default_writer_qos(), status), nullptr);
    write_status();
    send_goal_.emplace(participant, base + "send_goal", *types_.send_request, *types_.send_response,
                       intake(Service::send_goal), news_);
    cancel_goal_.emplace(participant, base + "cancel_goal", message_info<srv::CancelGoal_Request>(),
                         message_info<srv::CancelGoal_Response>(), intake(Service::cancel_goal), news_);
    get_result_.emplace(participant, base + "get_result", *types_.result_request, *types_.result_response,
                        intake(Service::get_result), news_);
  } catch (...) {
    remove();
    throw;
  }
}

void ActionServer::remove() {
  write_replies();
  for (auto* endpoint : {&send_goal_, &cancel_goal_, &get_result_})
    if (*endpoint && !table_.goals().empty()) (*endpoint)->wait_for_acknowledgments();
  for (auto* endpoint : {&send_goal_, &cancel_goal_, &get_result_})
    if (*endpoint) (*endpoint)->remove(participant_);
  participant_.remove(std::exchange(feedback_, nullptr));
  participant_.remove(std::exchange(status_, nullptr));
}

RosEndpoint::OnRequest ActionServer::intake(Service service) {
  return [this, service](const RosEndpoint::Caller& caller, std::span<const std::uint8_t> sample) {
    {
      const std::lock_guard lock(mutex_);
      if (incoming_.size() >= kMaxWaiting) return;  // the caller's time-out reports it
      incoming_.push_back(
          {service, caller, std::string(reinterpret_cast<const char*>(sample.data()), sample.size())});
    }
    news_();
  };
}

void ActionServer::serve(ActionExecutor& executor, std::int64_t present_ns) {
  std::vector<Incoming> incoming;
  {
    const std::lock_guard lock(mutex_);
    incoming.swap(incoming_);
  }
  for (const Incoming& one : incoming) {
    switch (one.service) {
      case Service::send_goal:
        send_goal(one, executor, present_ns);
        break;
      case Service::cancel_goal:
        cancel_goal(one, executor);
        break;
      case Service::get_result:
        get_result(one);
        break;
    }
  }
  expire();
  write_replies();
}

void ActionServer::send_goal(const Incoming& incoming, ActionExecutor& executor, std::int64_t present_ns) {
  const auto id = types_.goal_id(sample_bytes(incoming.sample));
  if (!id) return;
  const std::uint64_t number = ++numbers_;
  bool accepted = table_.accept(*id, present_ns, number);
  if (accepted && executor.begin(sample_bytes(incoming.sample), number)) {
    table_.withdraw(number);
    accepted = false;
  }
  // The response of every action is the same on the wire.
  simulation_interfaces::action::SimulateSteps_SendGoal_Response response;
  response.accepted = accepted;
  response.stamp = to_stamp(present_ns);
  reply(*send_goal_, incoming.caller, encoded(response));
  if (!accepted) return;
  write_status();
  if (table_.change(number, GoalState::executing, 0)) write_status();
}

void ActionServer::cancel_goal(const Incoming& incoming, ActionExecutor& executor) {
  action_msgs::srv::CancelGoal_Request request;
  if (!cdr::read(sample_bytes(incoming.sample), request)) return;
  const auto& meant = request.goal_info;
  const auto found = table_.find_cancelled(meant.goal_id.uuid, nanoseconds_of(meant.stamp));
  action_msgs::srv::CancelGoal_Response response;
  response.return_code = static_cast<std::int8_t>(found.code);
  for (const GoalTable::Goal& goal : found.goals) {
    response.goals_canceling.push_back({{goal.id}, to_stamp(goal.stamp_ns)});
    table_.change(goal.number, GoalState::canceling, 0);
  }
  reply(*cancel_goal_, incoming.caller, encoded(response));
  if (found.goals.empty()) return;
  write_status();
  for (const GoalTable::Goal& goal : found.goals) executor.cancel(goal.number);
}

void ActionServer::get_result(const Incoming& incoming) {
  // Only the goal id, for every action.
  simulation_interfaces::action::SimulateSteps_GetResult_Request request;
  if (!cdr::read(sample_bytes(incoming.sample), request)) return;
  const GoalTable::Goal* goal = table_.find(request.goal_id.uuid);
  if (goal == nullptr) return reply(*get_result_, incoming.caller, types_.unknown_result);
  if (const auto result = results_.find(goal->number); result != results_.end())
    return reply(*get_result_, incoming.caller, result->second);
  if (asking_.size() >= kMaxWaiting) asking_.erase(asking_.begin());
  asking_.push_back({incoming.caller, goal->number});
}

void ActionServer::feedback(std::uint64_t number, const std::function<std::string(const GoalId&)>& make) {
  const GoalTable::Goal* goal = table_.find(number);
  if (goal == nullptr || is_end(goal->state)) return;
  std::string sample = make(goal->id);
  (void)written(*feedback_, sample);
}

void ActionServer::end(std::uint64_t number, GoalState state, std::string response) {
  if (!table_.change(number, state, monotonic_now_ns())) return;
  std::erase_if(asking_, [&](const Asking& asking) {
    if (asking.number != number) return false;
    reply(*get_result_, asking.caller, response);
    return true;
  });
  results_[number] = std::move(response);
  write_status();
  write_replies();
}

bool ActionServer::canceling(std::uint64_t number) const {
  const GoalTable::Goal* goal = table_.find(number);
  return goal != nullptr && goal->state == GoalState::canceling;
}

void ActionServer::reply(RosEndpoint& endpoint, const RosEndpoint::Caller& caller, std::string sample) {
  outgoing_.push_back({&endpoint, caller, std::move(sample), monotonic_now_ns()});
  if (outgoing_.size() > kMaxWaiting) outgoing_.erase(outgoing_.begin());
}

/// A reply waits until its caller's reader is known.
void ActionServer::write_replies() {
  const std::int64_t now = monotonic_now_ns();
  std::erase_if(outgoing_, [&](Outgoing& one) {
    if (!one.endpoint->reaches(one.caller) && now - one.since_ns <= kLongestReplyWait_ns) return false;
    one.endpoint->write(one.caller, std::move(one.sample));
    return true;
  });
}

void ActionServer::write_status() {
  action_msgs::msg::GoalStatusArray list;
  for (const GoalTable::Goal& goal : table_.goals())
    list.status_list.push_back({{{goal.id}, to_stamp(goal.stamp_ns)}, static_cast<std::int8_t>(goal.state)});
  std::string sample = encoded(list);
  (void)written(*status_, sample);
}

void ActionServer::expire() {
  const auto gone = table_.expire(monotonic_now_ns());
  for (const GoalTable::Goal& goal : gone) results_.erase(goal.number);
  if (!gone.empty()) write_status();
}

}  // namespace takt
