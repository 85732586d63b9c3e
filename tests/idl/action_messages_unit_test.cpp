// Messages of actions, byte for byte as an independent encoder writes them (action_golden.py).
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <numeric>
#include <string>

#include "idl/common/cdr.h"
#include "takt_actions.h"

namespace takt {
namespace {

std::map<std::string, std::string> golden() {
  std::ifstream file(std::string(TAKT_SOURCE_DIR) + "/tests/idl/action_messages.golden");
  std::map<std::string, std::string> samples;
  std::string name, hex;
  while (file >> name >> hex) samples[name] = hex;
  return samples;
}

template <Message Type>
void expect_golden(const std::string& name, const Type& message) {
  std::string bytes, hex;
  ASSERT_TRUE(cdr::write(message, bytes));
  for (const char byte : bytes) {
    char digits[3];
    (void)std::snprintf(digits, sizeof(digits), "%02x", static_cast<unsigned char>(byte));
    hex += digits;
  }
  const auto samples = golden();
  ASSERT_TRUE(samples.contains(name));
  EXPECT_EQ(hex, samples.at(name)) << name;
  Type read;
  ASSERT_TRUE(cdr::read({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, read));
  EXPECT_EQ(read, message);
}

std::array<std::uint8_t, 16> sixteen_bytes() {
  std::array<std::uint8_t, 16> made{};
  std::iota(made.begin(), made.end(), std::uint8_t{1});
  return made;
}

using Point = trajectory_msgs::msg::JointTrajectoryPoint;
const Point kDesired{{0.25, -1.5}, {0.5, 0.0}, {1.0, 2.0}, {}, {1, 50'000'000}};
const Point kActual{{0.24, -1.5}, {0.5, 0.0}, {}, {}, {1, 50'000'000}};
const Point kError{{0.01, 0.0}, {0.0, 0.0}, {}, {}, {1, 50'000'000}};

TEST(ActionMessages, TrajectoriesHaveTheBytesOfAnIndependentEncoder) {
  using Action = actions::FollowJointTrajectory;
  Action::FeedbackMessage feedback;
  feedback.goal_id.uuid = sixteen_bytes();
  feedback.feedback.header.stamp = {3, 7};
  feedback.feedback.joint_names = {"a", "elbow"};
  feedback.feedback.desired = kDesired, feedback.feedback.actual = kActual, feedback.feedback.error = kError;
  expect_golden("FollowJointTrajectory_FeedbackMessage", feedback);

  Action::SendGoalRequest request;
  request.goal_id.uuid = sixteen_bytes();
  request.goal.trajectory.header = {{3, 7}, "base"};
  request.goal.trajectory.joint_names = {"a", "elbow"};
  request.goal.trajectory.points = {kDesired, kActual};
  request.goal.path_tolerance = {{"a", 0.1, 0.2, 0.0}};
  request.goal.goal_tolerance = {{"elbow", 0.01, -1.0, 0.0}};
  request.goal.goal_time_tolerance = {2, 500'000'000};
  expect_golden("FollowJointTrajectory_SendGoal_Request", request);
  expect_golden("FollowJointTrajectory_GetResult_Response", Action::GetResultResponse{6, {-4, "off"}});
}

TEST(ActionMessages, GrippersStepsAndStatesHaveTheBytesOfAnIndependentEncoder) {
  expect_golden("GripperCommand_GetResult_Response",
                actions::GripperCmd::GetResultResponse{4, {0.05, 12.5, true, false}});
  expect_golden("SimulateSteps_FeedbackMessage",
                actions::SimulateSteps::FeedbackMessage{{sixteen_bytes()}, {3, std::uint64_t{1} << 40U}});
  const action_msgs::msg::GoalInfo info{{sixteen_bytes()}, {3, 7}};
  expect_golden("GoalStatusArray", action_msgs::msg::GoalStatusArray{{{info, 2}, {info, 5}}});
  expect_golden("CancelGoal_Response", action_msgs::srv::CancelGoal_Response{0, {info}});
}

}  // namespace
}  // namespace takt
