#pragma once
// A client of one ROS 2 action over plain Fast DDS, as rclcpp_action on rmw_fastrtps is one.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "takt_actions.h"
#include "tests/support/ros_caller.h"

namespace takt::test {

inline std::array<std::uint8_t, 16> goal_id(std::uint8_t number) {
  std::array<std::uint8_t, 16> id{};
  id[0] = 0xA5, id[15] = number;
  return id;
}

template <typename Action>
class ActionClient {
 public:
  using Goal = typename Action::Goal;
  using Feedback = typename Action::FeedbackMessage;
  using Response = typename Action::GetResultResponse;

  ActionClient(RawDdsClient& dds, const std::string& element)
      : name_(name(element)),
        feedback(dds.read<Feedback>("rt/" + test_cell() + "/" + name_ + "feedback", true, false, 1000)),
        status(dds.read<action_msgs::msg::GoalStatusArray>("rt/" + test_cell() + "/" + name_ + "status", true,
                                                           true, 100)),
        send_(dds, name_ + "send_goal"),
        cancel_(dds, name_ + "cancel_goal"),
        result_(dds, name_ + "get_result") {
    (void)status->wait_until([](const auto& messages) { return !messages.empty(); });
  }

  typename Action::SendGoalResponse send(std::uint8_t number, const Goal& goal) {
    typename Action::SendGoalRequest request;
    request.goal_id.uuid = goal_id(number);
    request.goal = goal;
    return send_.call(request);
  }
  action_msgs::srv::CancelGoal_Response cancel(std::uint8_t number) {
    action_msgs::srv::CancelGoal_Request request;
    request.goal_info.goal_id.uuid = goal_id(number);
    return cancel_.call(request);
  }
  action_msgs::srv::CancelGoal_Response cancel_all() { return cancel_.call({}); }
  Response result(std::uint8_t number) { return result_.call(asking(number)); }
  /// Asks now, for await_result() later.
  std::int64_t ask_result(std::uint8_t number) { return result_.send(asking(number)); }
  Response await_result(std::int64_t asked) { return result_.await(asked); }
  /// The states of this goal that were published, each once, in order.
  std::vector<int> states(std::uint8_t number, int last) {
    std::vector<int> seen;
    (void)status->wait_until([&](const auto& messages) {
      seen.clear();
      for (const auto& message : messages)
        for (const auto& one : message.status_list)
          if (one.goal_info.goal_id.uuid == goal_id(number) && (seen.empty() || seen.back() != one.status))
            seen.push_back(one.status);
      return !seen.empty() && seen.back() == last;
    });
    return seen;
  }

 private:
  static std::string name(const std::string& element) {
    const std::string full = Action::info.name(test_cell(), element);
    return full.substr(test_cell().size() + 1) + "/_action/";
  }
  static typename Action::GetResultRequest asking(std::uint8_t number) {
    typename Action::GetResultRequest request;
    request.goal_id.uuid = goal_id(number);
    return request;
  }

  std::string name_;

 public:
  std::shared_ptr<Inbox<Feedback>> feedback;
  std::shared_ptr<Inbox<action_msgs::msg::GoalStatusArray>> status;

 private:
  Caller<typename Action::SendGoalRequest, typename Action::SendGoalResponse> send_;
  Caller<action_msgs::srv::CancelGoal_Request, action_msgs::srv::CancelGoal_Response> cancel_;
  Caller<typename Action::GetResultRequest, typename Action::GetResultResponse> result_;
};

}  // namespace takt::test
