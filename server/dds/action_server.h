#pragma once
// One ROS 2 action on the wire: the services send_goal, cancel_goal and get_result and the topics feedback and status,
// with the bookkeeping of its goals (requests/goal_table.h). What a goal does is left to an ActionExecutor.
//
// Requests arrive in threads of DDS and wait; everything else happens in the publishing thread, in the order of arrival.
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "idl/common/cdr.h"
#include "server/dds/participant.h"
#include "server/dds/ros_endpoint.h"
#include "server/runtime/requests/goal_table.h"
#include "takt_actions.h"

namespace takt {

/// Does the goals of one action. The publishing thread calls it.
class ActionExecutor {
 public:
  virtual ~ActionExecutor() = default;
  /// Begins a goal. `request`: of send_goal, as plain CDR. `number`: of the goal in calls of cancel() and
  /// ActionServer::end(), which reports its end. Returns nothing for an accepted goal, else the sentence of the event that
  /// reports the refusal.
  virtual std::optional<std::string> begin(std::span<const std::uint8_t> request, std::uint64_t number) = 0;
  /// Asks for the end of a goal; its end follows.
  virtual void cancel(std::uint64_t number) = 0;
};

class ActionServer {
 public:
  /// The messages of one action.
  struct Types {
    const MessageInfo *send_request, *send_response, *result_request, *result_response, *feedback;
    /// The goal id that a request of send_goal begins with; std::nullopt where the bytes are no such request.
    std::optional<GoalId> (*goal_id)(std::span<const std::uint8_t> request);
    /// A response of get_result for an unknown goal.
    std::string unknown_result;
  };
  /// `name` without a slash at its beginning. `news` wakes the publishing thread; `numbers` counts the goals of the server.
  /// Throws DdsError.
  ActionServer(Participant& participant, const std::string& name, Types types, std::uint64_t& numbers,
               std::function<void()> news);
  ActionServer(const ActionServer&) = delete;
  ActionServer& operator=(const ActionServer&) = delete;

  // The publishing thread:

  /// Handles waiting requests, and writes replies that wait for the discovery of their caller. `present_ns`: simulated time.
  void serve(ActionExecutor& executor, std::int64_t present_ns);
  /// `feedback`: a FeedbackMessage without its goal id, which it gets here: `make` is called with it.
  void feedback(std::uint64_t number, const std::function<std::string(const GoalId&)>& make);
  /// The goal has ended; `response`: of get_result.
  void end(std::uint64_t number, GoalState state, std::string response);
  /// A cancellation of it was accepted, and it has not ended.
  bool canceling(std::uint64_t number) const;
  /// Replies wait for their caller's reader.
  bool replies_wait() const { return !outgoing_.empty(); }
  bool knows(std::uint64_t number) const { return table_.find(number) != nullptr; }
  const GoalTable& table() const { return table_; }

  /// Removes its topics; replies under way are waited for briefly.
  void remove();

 private:
  enum class Service { send_goal, cancel_goal, get_result };
  struct Incoming {
    Service service;
    RosEndpoint::Caller caller;
    std::string sample;
  };
  struct Outgoing {
    RosEndpoint* endpoint;
    RosEndpoint::Caller caller;
    std::string sample;
    std::int64_t since_ns;
  };
  struct Asking {
    RosEndpoint::Caller caller;
    std::uint64_t number;
  };

  RosEndpoint::OnRequest intake(Service service);
  void send_goal(const Incoming& incoming, ActionExecutor& executor, std::int64_t present_ns);
  void cancel_goal(const Incoming& incoming, ActionExecutor& executor);
  void get_result(const Incoming& incoming);
  void reply(RosEndpoint& endpoint, const RosEndpoint::Caller& caller, std::string sample);
  void write_replies();
  void write_status();
  void expire();

  Participant& participant_;
  const Types types_;
  std::uint64_t& numbers_;
  const std::function<void()> news_;
  std::mutex mutex_;
  std::vector<Incoming> incoming_;  // guarded by mutex_
  GoalTable table_;
  std::map<std::uint64_t, std::string> results_;  ///< by goal that has ended
  std::vector<Asking> asking_;                    ///< for results to come
  std::vector<Outgoing> outgoing_;
  std::optional<RosEndpoint> send_goal_, cancel_goal_, get_result_;
  dds::DataWriter* feedback_ = nullptr;
  dds::DataWriter* status_ = nullptr;
};

/// Of a row of takt_actions.h.
template <typename Action>
ActionServer::Types action_types() {
  ActionServer::Types types{&message_info<typename Action::SendGoalRequest>(),
                            &message_info<typename Action::SendGoalResponse>(),
                            &message_info<typename Action::GetResultRequest>(),
                            &message_info<typename Action::GetResultResponse>(),
                            &message_info<typename Action::FeedbackMessage>(),
                            [](std::span<const std::uint8_t> request) -> std::optional<GoalId> {
                              typename Action::SendGoalRequest message;
                              if (!cdr::read(request, message)) return std::nullopt;
                              return message.goal_id.uuid;
                            },
                            {}};
  (void)cdr::write(typename Action::GetResultResponse{}, types.unknown_result);
  return types;
}

}  // namespace takt
