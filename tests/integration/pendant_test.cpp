// The teach pendant of takt view commands targets without an owner; the status names the owners.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client_lib/client.h"
#include "client_lib/kinematics/arm.h"
#include "client_lib/view/pendant.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Arguments;
using takt::Client;
using takt::ControlResult;
using takt::State;
using takt::Status;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::kGenerous;
using takt::view::Answer;
using takt::view::Pendant;

template <typename Request>
Answer ask(Pendant& pendant, const Request& request) {
  return pendant.request(std::string(takt::request_info<Request>().name), takt::arguments_of(request))
      .value();
}

/// The joints of Robot1 once it is away from `from` and stands: the times of a motion would be compared with a state that may be old.
std::vector<double> joints_after_motion(const Client& client, const std::vector<double>& from) {
  const auto arrived = [&](const State& s) {
    const auto& robot = s.robot("Robot1");
    double distance = 0.0, speed = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      distance = std::max(distance, std::abs(robot.position[i] - from[i]));
      speed = std::max(speed, std::abs(robot.velocity[i]));
    }
    return distance > 1e-3 && speed < 1e-9;
  };
  const auto state = client.wait_for(takt::topics::state, arrived, kGenerous);
  return state ? state->robot("Robot1").position : std::vector<double>{};
}

TEST(Pendant, MovesJointsAndTheToolAlongALine) {
  HostedService service;
  Client client(client_options());
  Pendant pendant(client_options());
  client.play();

  const std::vector<double> start = client.state().robot("Robot1").position;
  std::vector<double> wanted = start;
  wanted[0] += 0.1;
  const Answer joints = ask(pendant, takt::pendant::JogJoints{"Robot1", wanted, 0.5});
  ASSERT_EQ(joints.result, ControlResult::ok) << joints.message;
  takt::pendant::JogJointsResponse response;
  ASSERT_FALSE(takt::read_arguments("jog_joints", joints.values, response));
  EXPECT_GT(response.duration, 0.1);
  const std::vector<double> reached = joints_after_motion(client, start);
  ASSERT_EQ(reached.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(reached[i], wanted[i], 1e-9);

  // 20 mm along its own z and 0.2 rad about its own x: the pose that follows from the definition of the frames.
  const takt::Arm arm(*client.cell(), "Robot1", "Gripper1");
  const takt::Pose before = arm.forward_kinematics(reached);
  const Answer line =
      ask(pendant, takt::pendant::JogLine{
                       "Robot1", "Gripper1", takt::JogFrame::tool, {0.0, 0.0, -0.02}, {0.2, 0.0, 0.0}, 0.1});
  ASSERT_EQ(line.result, ControlResult::ok) << line.message;
  takt::pendant::JogLineResponse took;
  ASSERT_FALSE(takt::read_arguments("jog_line", line.values, took));
  EXPECT_GT(took.duration, 0.1);
  const std::vector<double> moved = joints_after_motion(client, reached);
  ASSERT_EQ(moved.size(), wanted.size());
  const takt::Pose after = arm.forward_kinematics(moved);
  EXPECT_LT((after.p - (before.p - 0.02 * before.R.col(2))).norm(), 1e-6);
  const Eigen::Matrix3d turned =
      before.R * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  EXPECT_LT((after.R - turned).norm(), 1e-6);

  // Beyond a joint's range nothing moves, and the sentence names the joint.
  wanted[0] = 100.0;
  const Answer beyond = ask(pendant, takt::pendant::JogJoints{"Robot1", wanted, 0.5});
  EXPECT_EQ(beyond.result, ControlResult::failed);
  expect_words(beyond.message, {client.cell()->robots[0].joints[0].name.c_str(), "100"});
}

TEST(Pendant, LeavesATargetThatAnotherSenderOwnsAlone) {
  HostedService service;
  Client client(client_options());
  Pendant pendant(client_options());
  client.play();
  const std::vector<double> here = client.state().robot("Robot1").position;
  client.send_joint_command("Robot1", here);
  const auto owned = client.wait_for(
      takt::topics::status, [](const Status& s) { return !s.owners.empty(); }, kGenerous);
  ASSERT_TRUE(owned.has_value());
  EXPECT_EQ(owned->owners[0].target, "Robot1");
  EXPECT_EQ(owned->owners[0].sender, client.client_id());

  const Answer refused = ask(pendant, takt::pendant::JogJoints{"Robot1", here, 0.5});
  EXPECT_EQ(refused.result, ControlResult::incorrect_state);
  expect_words(refused.message, {"Robot1", client.client_id().c_str()});
  EXPECT_EQ(ask(pendant, takt::pendant::JogJoints{"Robot2", {}, 0.5}).result, ControlResult::failed);
  EXPECT_EQ(ask(pendant, takt::pendant::StopJogging{"Robot9"}).result, ControlResult::not_found);

  // A target without an owner gets it as its owner, until it leaves by itself.
  EXPECT_EQ(
      ask(pendant, takt::pendant::CommandGripper{"Gripper2", takt::GripperAction::close, 0.0, 0.0}).result,
      ControlResult::ok);
  const auto owns = [](const Status& s) {
    for (const auto& [target, sender] : s.owners)
      if (target == "Gripper2" && sender.starts_with("pendant-")) return true;
    return false;
  };
  EXPECT_TRUE(client.wait_for(takt::topics::status, owns, kGenerous));
  EXPECT_TRUE(client.wait_for(
      takt::topics::state, [](const State& s) { return s.gripper("Gripper2").closed; }, kGenerous));
  EXPECT_TRUE(client.wait_for(
      takt::topics::status, [&](const Status& s) { return !owns(s); }, kGenerous));
}

}  // namespace
