// The actions of robots and grippers, by a client on Fast DDS that behaves as rclcpp_action on rmw_fastrtps does.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>

#include "idl/common/stamp.h"
#include "tests/support/action_client.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"

namespace takt::test {
namespace {

using Follow = ActionClient<actions::FollowJointTrajectory>;
using Goal = actions::FollowJointTrajectory::Goal;
using States = std::vector<int>;

RunLoopOptions free_running() {
  RunLoopOptions options;
  options.pace = Pace::free;
  options.state = SimulationState::playing;
  return options;
}
RunLoopOptions in_real_time() {
  RunLoopOptions options = free_running();
  options.pace = Pace::realtime;
  return options;
}

/// The first joint goes by `distance_rad` in `duration_s`; all others stay.
Goal turn(const CellDescription& cell, double distance_rad, double duration_s) {
  const std::vector<double> start{
      0, -1.5707963267948966, 1.5707963267948966, -1.5707963267948966, -1.5707963267948966, 0};
  Goal goal;
  for (const JointModel& joint : cell.robots[0].arm.joints) goal.trajectory.joint_names.push_back(joint.name);
  auto& point = goal.trajectory.points.emplace_back();
  point.positions = start;
  point.positions[0] += distance_rad;
  point.velocities.assign(start.size(), 0.0);
  const auto ns = to_nanoseconds(duration_s);
  point.time_from_start = {static_cast<std::int32_t>(ns / 1'000'000'000),
                           static_cast<std::uint32_t>(ns % 1'000'000'000)};
  return goal;
}

/// What a client on DDS hears. It outlives the participant that listens.
struct Listening {
  RawDdsClient dds{test_domain()};
  std::unique_ptr<Follow> robot;
  Listening() : robot(std::make_unique<Follow>(dds, "Robot1")) {}
};

TEST(RosActions, ATrajectoryIsFollowedToItsEnd) {
  DdsService service(free_running());
  Listening client;
  const auto& cell = service.loop->cell();
  EXPECT_TRUE(client.robot->status->messages().front().status_list.empty());
  EXPECT_EQ(client.robot->result(1).status, 0) << "an unknown goal";
  const auto sent = client.robot->send(1, turn(cell, 0.3, 2.0));
  ASSERT_TRUE(sent.accepted);
  const auto early = client.robot->ask_result(1), twice = client.robot->ask_result(1);
  EXPECT_FALSE(client.robot->send(1, turn(cell, 0.1, 2.0)).accepted) << "the same id again";
  const auto result = client.robot->await_result(early);
  EXPECT_EQ(result.status, 4);
  EXPECT_EQ(result.result.error_code, 0) << result.result.error_string;
  EXPECT_EQ(client.robot->await_result(twice), result);
  EXPECT_EQ(client.robot->result(1), result) << "asked after the end";
  EXPECT_EQ(client.robot->states(1, 4), (States{1, 2, 4}));
  ASSERT_TRUE(client.robot->feedback->wait_until([](const auto& all) { return all.size() >= 40; }));
  const auto feedback = client.robot->feedback->messages();
  EXPECT_LE(feedback.size(), 42U) << "20 Hz of simulated time";
  for (std::size_t i = 0; i < feedback.size(); ++i) {
    const auto& one = feedback[i].feedback;
    ASSERT_EQ(feedback[i].goal_id.uuid, goal_id(1));
    ASSERT_EQ(one.joint_names.size(), 6U);
    const double t = one.desired.time_from_start.sec + 1e-9 * one.desired.time_from_start.nanosec;
    EXPECT_NEAR(t, 0.05 * static_cast<double>(i), 1e-9);
    // The cubic of the path in closed form, at level of detail 1 the robot is exactly there.
    const double u = t / 2.0;
    EXPECT_NEAR(one.desired.positions[0], 0.3 * u * u * (3.0 - 2.0 * u), 1e-9);
    EXPECT_NEAR(one.actual.positions[0], one.desired.positions[0], 1e-9);
    EXPECT_NEAR(one.error.positions[0], 0.0, 1e-9);
    EXPECT_NEAR(one.desired.velocities[0], 0.9 * u * (1.0 - u), 1e-9);
    EXPECT_NEAR(one.desired.accelerations[0], 0.45 * (1.0 - 2.0 * u), 1e-9);
  }
  service.stop();
  Snapshot snapshot = service.simulation().make_snapshot();
  EXPECT_NEAR(snapshot.robots[0].position[0], 0.3, 1e-9);
}

TEST(RosActions, WrongGoalsAreRefused) {
  DdsService service(free_running());
  Listening client;
  const auto& cell = service.loop->cell();
  std::uint8_t number = 0;
  const auto refused = [&](const std::function<void(Goal&)>& spoil) {
    Goal goal = turn(cell, 0.1, 1.0);
    spoil(goal);
    return !client.robot->send(++number, goal).accepted;
  };
  // Its end is also a time behind which stamps are old.
  EXPECT_FALSE(refused([](Goal&) {}));
  EXPECT_EQ(client.robot->result(number).status, 4);
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points.clear(); }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.joint_names[0] = "nobody"; }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.joint_names[0] = g.trajectory.joint_names[1]; }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.joint_names.pop_back(); }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points[0].positions.clear(); }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points[0].positions.pop_back(); }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points[0].effort.assign(6, 0.0); }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points[0].velocities[0] = 0.1; }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points.push_back(g.trajectory.points[0]); }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points[0].positions[0] = 100.0; }));
  EXPECT_TRUE(refused([](Goal& g) { g.trajectory.points[0].positions[0] = NAN; }));
  EXPECT_TRUE(refused([](Goal& g) { g.multi_dof_trajectory.points.emplace_back(); }));
  EXPECT_TRUE(refused([](Goal& g) { g.path_tolerance.push_back({"nobody", 0.1, 0, 0}); }));
  EXPECT_TRUE(refused([&](Goal& g) {
    g.path_tolerance.push_back({g.trajectory.joint_names[0], -2.0, 0, 0});
  }));
  EXPECT_TRUE(refused([](Goal& g) {
    g.trajectory.header.stamp.nanosec = 1;
    g.trajectory.points[0].time_from_start = {0, 1};
  }));
}

TEST(RosActions, ANewGoalPreemptsTheRunningOneAndACommandByTopicAbortsIt) {
  DdsService service(in_real_time());
  Listening client;
  const auto& cell = service.loop->cell();
  ASSERT_TRUE(client.robot->send(1, turn(cell, 0.3, 1000.0)).accepted);
  ASSERT_TRUE(client.robot->send(2, turn(cell, 0.3, 1000.0)).accepted);
  const auto first = client.robot->result(1);
  EXPECT_EQ(first.status, 6);
  EXPECT_EQ(first.result.error_code, -1);
  EXPECT_EQ(first.result.error_string, "Current goal preempted by new incoming action.");
  const auto asked = client.robot->ask_result(2);
  auto topic = client.dds.write<trajectory_msgs::msg::JointTrajectory>("rt/" + test_cell() +
                                                                       "/Robot1/joint_trajectory");
  ASSERT_TRUE(topic.matches->wait_for(1));
  auto other = turn(cell, 0.1, 1.0).trajectory;
  ASSERT_TRUE(written(*topic.writer, other));
  const auto second = client.robot->await_result(asked);
  EXPECT_EQ(second.status, 6);
  EXPECT_EQ(second.result.error_code, -1);
}

TEST(RosActions, ACancelledGoalStopsTheRobot) {
  DdsService service(in_real_time());
  Listening client;
  const auto& cell = service.loop->cell();
  EXPECT_EQ(client.robot->cancel(9).return_code, 2);
  ASSERT_TRUE(client.robot->send(1, turn(cell, 3.0, 30.0)).accepted);
  ASSERT_TRUE(client.robot->feedback->wait_until([](const auto& all) { return all.size() >= 3; }));
  const auto cancelled = client.robot->cancel(1);
  EXPECT_EQ(cancelled.return_code, 0);
  ASSERT_EQ(cancelled.goals_canceling.size(), 1U);
  EXPECT_EQ(cancelled.goals_canceling[0].goal_id.uuid, goal_id(1));
  EXPECT_EQ(client.robot->result(1).status, 5);
  EXPECT_EQ(client.robot->states(1, 5), (States{1, 2, 3, 5}));
  EXPECT_EQ(client.robot->cancel(1).return_code, 3);
  EXPECT_TRUE(client.robot->cancel_all().goals_canceling.empty());
  // The robot stands wherever it was: a goal that leads through another place begins there.
  ASSERT_TRUE(client.robot->send(2, turn(cell, 0.0, 2.0)).accepted);
  EXPECT_EQ(client.robot->result(2).status, 4);
  service.stop();
  Snapshot snapshot = service.simulation().make_snapshot();
  EXPECT_NEAR(snapshot.robots[0].position[0], 0.0, 1e-9);
}

TEST(RosActions, AGoalInPauseBeginsWithTheNextStepAndEndsWithAReset) {
  RunLoopOptions options = free_running();
  options.state = SimulationState::paused;
  DdsService service(options);
  Listening client;
  const auto& cell = service.loop->cell();
  ASSERT_TRUE(client.robot->send(1, turn(cell, 0.3, 1.0)).accepted);
  const auto asked = client.robot->ask_result(1);
  RawCellClient control;
  ASSERT_EQ(control.request("step", {{"steps", "500"}}).result, 1);
  ASSERT_TRUE(client.robot->feedback->wait_until([](const auto& all) { return all.size() >= 11; }));
  ASSERT_EQ(control.request("reset").result, 1);
  const auto result = client.robot->await_result(asked);
  EXPECT_EQ(result.status, 6);
  EXPECT_EQ(result.result.error_code, -1);
  ASSERT_TRUE(client.robot->send(2, turn(cell, 0.3, 1.0)).accepted);
  EXPECT_EQ(client.robot->cancel(2).return_code, 0);
  EXPECT_EQ(client.robot->result(2).status, 5) << "without a step";
}

TEST(RosActions, AGoalWithinItsToleranceSucceeds) {
  auto model = service_model(test_cell());
  DdsService service(free_running(), model);
  Listening client;
  const auto& cell = service.loop->cell();
  Goal within = turn(cell, 0.3, 1.0);
  // Linear pieces jump in velocity, which the robot spreads over one step: off by most at the beginning.
  within.trajectory.points[0].velocities.clear();
  within.goal_tolerance.push_back({within.trajectory.joint_names[0], 1e-6, 0.0, 0.0});
  within.goal_time_tolerance = {1, 0};
  ASSERT_TRUE(client.robot->send(1, within).accepted);
  EXPECT_EQ(client.robot->result(1).status, 4);
}

TEST(RosActions, TwentyGoalsInARowEndOneAfterTheOther) {
  DdsService service(free_running());
  Listening client;
  const auto& cell = service.loop->cell();
  for (std::uint8_t number = 1; number <= 20; ++number) {
    ASSERT_TRUE(client.robot->send(number, turn(cell, number % 2 == 0 ? 0.0 : 0.1, 0.5)).accepted);
    ASSERT_EQ(client.robot->result(number).status, 4);
  }
  ASSERT_TRUE(client.robot->status->wait_until([](const auto& all) {
    return all.back().status_list.size() == 20 && all.back().status_list.back().status == 4;
  }));
}

TEST(RosActions, AGoalInLockstepTakesThePlaceOfItsController) {
  RunLoopOptions options = free_running();
  options.state = SimulationState::paused;
  options.pace = Pace::lockstep;
  DdsService service(options);
  Listening client;
  const auto& cell = service.loop->cell();
  RawCellClient control;
  ASSERT_EQ(
      control
          .request("register_controller",
                   {{"name", "plc"}, {"period", "0.008"}, {"command_timeout", "600"}, {"targets", "Robot1"}})
          .result,
      1);
  ASSERT_EQ(control.request("set_state", {{"state", "playing"}}).result, 1);
  ASSERT_TRUE(client.robot->send(1, turn(cell, 0.1, 0.5)).accepted);
  const auto result = client.robot->result(1);
  EXPECT_EQ(result.status, 4) << result.result.error_string;
  ASSERT_TRUE(client.robot->feedback->wait_until([](const auto& all) { return all.size() >= 10; }));
  EXPECT_EQ(client.robot->feedback->messages().back().feedback.header.stamp.nanosec, 450'000'000U);
  EXPECT_TRUE(control.status->wait_for([](const auto& status) { return status.step == 504; }))
      << "the next boundary waits for a command again";
}

TEST(RosActions, AGoalEndsWithItsScenario) {
  DdsService service(in_real_time());
  Listening client;
  ASSERT_TRUE(client.robot->send(1, turn(service.loop->cell(), 0.1, 1000.0)).accepted);
  const auto asked = client.robot->ask_result(1);
  RawCellClient control;
  ASSERT_EQ(control.request("unload_scenario").result, 1);
  EXPECT_EQ(client.robot->await_result(asked).status, 6);
}

using Gripper = ActionClient<actions::GripperCmd>;
using ParallelGripper = ActionClient<actions::ParallelGripperCmd>;

TEST(RosActions, AGripperGoesToAWidthByEitherAction) {
  DdsService service(free_running());
  std::unique_ptr<Gripper> gripper;
  std::unique_ptr<ParallelGripper> parallel;
  RawDdsClient dds(test_domain());
  gripper = std::make_unique<Gripper>(dds, "Gripper1");
  parallel = std::make_unique<ParallelGripper>(dds, "Gripper1");
  Gripper::Goal goal;
  goal.command.position = 0.05;
  ASSERT_TRUE(gripper->send(1, goal).accepted);
  const auto result = gripper->result(1);
  EXPECT_EQ(result.status, 4);
  EXPECT_TRUE(result.result.reached_goal);
  EXPECT_FALSE(result.result.stalled);
  EXPECT_NEAR(result.result.position, 0.05, 0.001);
  ParallelGripper::Goal wide;
  EXPECT_FALSE(parallel->send(1, wide).accepted) << "no position";
  wide.command.position = {0.1, 0.1};
  EXPECT_FALSE(parallel->send(2, wide).accepted) << "two positions";
  wide.command.position = {1.0};
  EXPECT_FALSE(parallel->send(3, wide).accepted) << "wider than the gripper";
  wide.command.position = {0.1};
  ASSERT_TRUE(parallel->send(4, wide).accepted);
  const auto opened = parallel->result(4);
  EXPECT_EQ(opened.status, 4);
  EXPECT_TRUE(opened.result.reached_goal);
  ASSERT_EQ(opened.result.state.position.size(), 1U);
  EXPECT_NEAR(opened.result.state.position[0], 0.1, 0.001);
  // A goal of the one action pre-empts one of the other.
  goal.command.position = 0.0;
  RawCellClient control;
  ASSERT_EQ(control.request("set_state", {{"state", "paused"}}).result, 1);
  ASSERT_TRUE(gripper->send(2, goal).accepted);
  ASSERT_EQ(control.request("step", {{"steps", "10"}}).result, 1);
  wide.command.position = {0.02};
  ASSERT_TRUE(parallel->send(5, wide).accepted);
  ASSERT_EQ(control.request("step", {{"steps", "10"}}).result, 1);
  EXPECT_EQ(gripper->result(2).status, 6);
}

TEST(RosActions, StepsAreTakenWithProgressAndCanBeCancelled) {
  RunLoopOptions options = free_running();
  options.state = SimulationState::paused;
  DdsService service(options);
  std::unique_ptr<ActionClient<actions::SimulateSteps>> steps;
  RawDdsClient dds(test_domain());
  steps = std::make_unique<ActionClient<actions::SimulateSteps>>(dds, "");
  EXPECT_FALSE(steps->send(1, {0}).accepted);
  ASSERT_TRUE(steps->send(2, {250}).accepted);
  const auto done = steps->result(2);
  EXPECT_EQ(done.status, 4);
  EXPECT_EQ(done.result.result.result, 1);
  actions::SimulateSteps::FeedbackMessage last;
  ASSERT_TRUE(
      steps->feedback->wait_for([](const auto& m) { return m.feedback.completed_steps == 250; }, &last));
  EXPECT_EQ(last.feedback.remaining_steps, 0U);
  ASSERT_TRUE(steps->send(3, {1'000'000'000}).accepted);
  EXPECT_FALSE(steps->send(4, {1}).accepted) << "one at a time";
  EXPECT_EQ(steps->cancel(3).return_code, 0);
  EXPECT_EQ(steps->result(3).status, 5);
  EXPECT_EQ(steps->states(3, 5), (States{1, 2, 3, 5}));
  RawCellClient control;
  ASSERT_EQ(control.request("set_state", {{"state", "playing"}}).result, 1);
  ASSERT_TRUE(steps->send(5, {1}).accepted);
  const auto refused = steps->result(5);
  EXPECT_EQ(refused.status, 6);
  EXPECT_EQ(refused.result.result.result, 3) << "it plays";
}

#ifdef TAKT_HAS_CYCLONE
std::vector<std::string> cyclone_arguments(const CellDescription& cell, const char* duration_s,
                                           const char* first) {
  std::vector<std::string> arguments{std::string(TAKT_BIN_DIR) + "/takt-test-cyclone-action",
                                     std::to_string(test_domain()),
                                     test_cell(),
                                     "Robot1",
                                     duration_s,
                                     first};
  for (const JointModel& joint : cell.robots[0].arm.joints) arguments.push_back(joint.name);
  return arguments;
}
void tell_cyclone() {
  ASSERT_EQ(setenv("CYCLONEDDS_URI",
                   "<General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces>"
                   "<AllowMulticast>true</AllowMulticast></General>",
                   1),
            0);
}

TEST(RosActions, AClientOnCycloneDdsFollowsATrajectory) {
  tell_cyclone();
  DdsService service(in_real_time());
  ChildProcess client(cyclone_arguments(service.loop->cell(), "0.5", "0.1"));
  EXPECT_EQ(client.wait(), 0) << client.text;
  EXPECT_NE(client.text.find("goals at first: 0"), std::string::npos) << client.text;
  EXPECT_NE(client.text.find("feedback: 6 joints, 6 positions, 0 of several"), std::string::npos)
      << client.text;
  EXPECT_NE(client.text.find("result: status 4, error 0, Goal successfully reached!"), std::string::npos)
      << client.text;
}

/// Samples that a dead reader has not acknowledged stay in the history of the replies.
TEST(RosActions, CallersOnCycloneDdsGetTheirFirstRepliesBesideADeadOne) {
  tell_cyclone();
  DdsService service(in_real_time());
  {
    ChildProcess dies(cyclone_arguments(service.loop->cell(), "1000", "0.1"));
    ASSERT_TRUE(dies.wait_for_output("accepted: 1")) << dies.text;
  }
  for (const char* first : {"0.1", "0.0", "0.1"}) {
    ChildProcess client(cyclone_arguments(service.loop->cell(), "0.5", first));
    EXPECT_EQ(client.wait(), 0) << client.text;
    EXPECT_NE(client.text.find("result: status 4"), std::string::npos) << client.text;
  }
}

TEST(RosActions, ClientsOnBothMiddlewaresCallAtOnce) {
  tell_cyclone();
  DdsService service(in_real_time());
  Listening own;
  const auto& cell = service.loop->cell();
  // Its result waits until the other's goal pre-empts it.
  ASSERT_TRUE(own.robot->send(1, turn(cell, 0.3, 1000.0)).accepted);
  const auto asked = own.robot->ask_result(1);
  ChildProcess client(cyclone_arguments(cell, "1000", "0.1"));
  // Meanwhile replies of the other kind come to both.
  for (int i = 0; i < 100; ++i) EXPECT_EQ(own.robot->result(99).status, 0);
  EXPECT_EQ(client.wait(), 0) << client.text;
  EXPECT_NE(client.text.find("cancel: code 0, 1 goals"), std::string::npos) << client.text;
  EXPECT_NE(client.text.find("result: status 5"), std::string::npos) << client.text;
  EXPECT_EQ(own.robot->await_result(asked).status, 6);
}
#endif

}  // namespace
}  // namespace takt::test
