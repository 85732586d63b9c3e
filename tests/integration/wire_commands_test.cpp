// Trajectories, device commands and standard topics over DDS; ownership after the owner falls silent.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "client_lib/client.h"
#include "client_lib/lockstep_controller.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/hosting_client.h"
#include "tests/support/test_device.h"

namespace takt {
namespace {

using takt::Seconds;
using takt::test::kGenerous;
using test::DdsService;
using test::RawCellClient;
namespace msg = takt_msgs::msg;

constexpr double kQuarter = 1.5707963267948966;

RunLoopOptions free_paused() {
  RunLoopOptions options;
  options.pace = Pace::free;
  options.state = SimulationState::paused;
  return options;
}

std::vector<double> at(double first) {
  return {first, -kQuarter, kQuarter, -kQuarter, -kQuarter, 0.0};
}

class WireCommands : public testing::Test {
 protected:
  WireCommands() {
    ClientOptions options;
    options.cell = test::test_cell();
    options.domain = static_cast<int>(test::test_domain());
    options.timeout = kGenerous;
    options.liveliness_timeout = kGenerous;
    client_ = std::make_unique<Client>(options);
  }
  static std::shared_ptr<CellModel> model() {
    auto model = test::service_model(test::test_cell());
    test::add_chamber(*model);
    return model;
  }
  /// Steps until this number of commands for the target were applied; they arrive meanwhile.
  void step_until_applied(std::size_t target, std::uint64_t count) {
    for (int attempt = 0; attempt < 6000; ++attempt) {
      client_->step(1);
      const auto applied = [&](const State& state) { return state.applied[target].count >= count; };
      if (client_->wait_for(takt::topics::state, applied, Seconds{0.01})) return;
    }
    ADD_FAILURE() << "the command was not applied";
  }

  DdsService service_{free_paused(), model()};
  std::unique_ptr<Client> client_;
};

TEST_F(WireCommands, ATrajectoryIsFollowedAndItsEndIsAnEvent) {
  client_->send_trajectory(
      "Robot1", {{0.1, at(0.01), std::vector<double>(6, 0.0)}, {0.2, at(0.03), std::vector<double>(6, 0.0)}});
  step_until_applied(0, 1);
  client_->step(250);
  const auto done = client_->wait_for(
      takt::topics::event, [](const auto& e) { return e.code == "trajectory_done"; }, kGenerous);
  ASSERT_TRUE(done.has_value());
  EXPECT_EQ(done->subject, "Robot1");
  EXPECT_EQ(done->message, "Robot1 is at the end of its trajectory.");
  const auto there = client_->wait_for(
      takt::topics::state,
      [](const State& s) { return std::abs(s.robot("Robot1").position[0] - 0.03) < 1e-12; }, kGenerous);
  EXPECT_TRUE(there.has_value());
}

TEST_F(WireCommands, InvalidTrajectoriesAreRefusedInEvents) {
  client_->send_trajectory("Robot1", {{0.1, at(3.0)}, {0.2, at(-3.0)}});
  const auto refused = client_->wait_for(
      takt::topics::event, [](const auto& e) { return e.code == "command_rejected"; }, kGenerous);
  ASSERT_TRUE(refused.has_value());
  EXPECT_NE(refused->message.find("velocity_out_of_range"), std::string::npos) << refused->message;
  EXPECT_FALSE(refused->sender.empty());
  // Only the simulation can decide this: too fast from the robot's position.
  client_->send_trajectory("Robot1", {{0.1, at(1.0)}});
  step_until_applied(0, 1);
  const auto late = client_->wait_for(
      takt::topics::event, [](const auto& e) { return e.code == "trajectory_refused"; }, kGenerous);
  ASSERT_TRUE(late.has_value());
  EXPECT_NE(late->message.find("velocity of joint 'shoulder_pan_joint'"), std::string::npos) << late->message;
  EXPECT_THROW(client_->send_trajectory("Robot9", {}), ClientError);
  EXPECT_THROW(client_->send_trajectory("Robot1", {{0.1, {1.0}}}), ClientError);
}

TEST_F(WireCommands, SignalsOfDevicesAreSetAndPublished) {
  const auto cell = client_->cell();
  ASSERT_EQ(cell->devices.size(), 1U);
  EXPECT_EQ(cell->devices[0].name, "Chamber");
  const auto& signals = cell->devices[0].signals;
  const std::vector<SignalDescription>& truth = service_.model->description.devices[0].signals;
  ASSERT_EQ(signals.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(signals[i].name, truth[i].name);
    EXPECT_EQ(signals[i].unit, truth[i].unit) << truth[i].name;
    EXPECT_EQ(signals[i].commanded, truth[i].commanded) << truth[i].name;
    EXPECT_EQ(signals[i].lower, truth[i].lower) << truth[i].name;
    EXPECT_EQ(signals[i].upper, truth[i].upper) << truth[i].name;
  }
  client_->set_signals("Chamber", {{"set_point", 120.0}, {"lamp", 1.0}});
  step_until_applied(4, 1);
  client_->step(500);
  const auto warm = client_->wait_for(
      takt::topics::state, [](const State& s) { return s.devices[0].signals[2] > 80.0; }, kGenerous);
  ASSERT_TRUE(warm.has_value());
  EXPECT_EQ(warm->devices[0].signals[0], 120.0);
  EXPECT_EQ(warm->devices[0].signals[1], 1.0);
  EXPECT_EQ(warm->applied[4].target, "Chamber");
  client_->set_signals("Chamber", {{"temperature", 30.0}});
  const auto refused = client_->wait_for(
      takt::topics::event, [](const auto& e) { return e.code == "command_rejected"; }, kGenerous);
  ASSERT_TRUE(refused.has_value());
  EXPECT_NE(refused->message.find("read_only_signal"), std::string::npos) << refused->message;
}

TEST_F(WireCommands, ALockstepControllerSetsSignalsInStepWithTime) {
  LockstepController controller(*client_, {.targets = {"Chamber", "Gripper1"}, .period_s = 0.01});
  controller.advance();  // no signal is set yet
  EXPECT_EQ(controller.state().devices[0].signals[2], 20.0);
  const double begin_s = controller.state().time;
  controller.set_signals("Chamber", {{"set_point", 120.0}});
  while (controller.state().time < begin_s + 0.5 - 1e-9) controller.advance();
  EXPECT_NEAR(controller.state().devices[0].signals[2], 120.0 - 100.0 * std::exp(-1.0), 1e-3);
  controller.set_signals("Chamber", {{"lamp", 1.0}});
  controller.advance();
  EXPECT_EQ(controller.state().devices[0].signals[0], 120.0);  // stays
  EXPECT_EQ(controller.state().devices[0].signals[1], 1.0);
  EXPECT_THROW(controller.move("Chamber", at(0.0)), ClientError);
  EXPECT_THROW(controller.grip("Chamber", GripperAction::open), ClientError);
  EXPECT_THROW(controller.set_signals("Gripper1", {{"lamp", 1.0}}), ClientError);
  EXPECT_THROW(controller.set_signals("Furnace", {{"lamp", 1.0}}), ClientError);
}

/// The sentence of advance() at a time-out; empty without one.
std::string timeout_of(LockstepController& controller) {
  try {
    controller.advance();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::timeout) << error.what();
    return error.what();
  }
  return "";
}

/// advance() of a cell that goes on; on a loaded machine its answer may take longer than one time-out.
const State& advanced(LockstepController& controller) {
  constexpr int kAttempts = 30;
  std::string late = "no attempt";
  for (int i = 0; i < kAttempts && !late.empty(); ++i) late = timeout_of(controller);
  EXPECT_EQ(late, "");
  return controller.state();
}

TEST_F(WireCommands, ALockstepControllerTimesOutWhileAnotherIsSilent) {
  int looks = 0;
  ClientOptions options = test::client_options();
  options.while_waiting = [&] { ++looks; };
  takt::Client looking(options);
  LockstepController controller(
      looking, {.targets = {"Gripper1"}, .period_s = 0.01, .name = "patient", .timeout = Seconds{2.0}});
  advanced(controller);
  LockstepController silent(
      *client_, {.targets = {"Chamber"}, .period_s = 0.01, .name = "silent", .timeout = kGenerous});
  const auto begin = std::chrono::steady_clock::now();
  const std::string late = timeout_of(controller);
  const Seconds waited = std::chrono::steady_clock::now() - begin;
  EXPECT_NE(late.find("did not come to 0.02 s"), std::string::npos) << late;
  EXPECT_NE(late.find("it stands at 0.01 s and is playing, waiting for silent"), std::string::npos) << late;
  EXPECT_GE(waited.count(), 2.0);
  EXPECT_GE(looks, 1);
  // The other answers after all: both continue, and no boundary was skipped.
  EXPECT_EQ(timeout_of(silent), "");
  EXPECT_NEAR(advanced(controller).time, 0.02, 1e-12);
  EXPECT_NEAR(silent.state().time, 0.02, 1e-12);
}

TEST_F(WireCommands, ALockstepControllerTimesOutOnAPausedCell) {
  LockstepController controller(*client_,
                                {.targets = {"Gripper1"}, .period_s = 0.01, .timeout = Seconds{1.0}});
  client_->pause();
  const std::string late = timeout_of(controller);
  EXPECT_NE(late.find("it stands at 0 s and is paused."), std::string::npos) << late;
  client_->play();
  EXPECT_NEAR(advanced(controller).time, 0.01, 1e-12);
}

TEST_F(WireCommands, FramesFormATreeFromTheWorldToEveryLink) {
  test::RawDdsClient raw(test::test_domain());
  const auto moving = raw.read<tf2_msgs::msg::TFMessage>("rt/tf", true, false, 100);
  const auto fixed = raw.read<tf2_msgs::msg::TFMessage>("rt/tf_static", true, true, 1);
  ASSERT_TRUE(fixed->wait_until([](const auto& m) { return !m.empty(); }));
  for (int attempt = 0; attempt < 600 && moving->messages().empty(); ++attempt) {
    client_->step(1);
    (void)moving->wait_briefly([](const auto& m) { return !m.empty(); });
  }
  ASSERT_FALSE(moving->messages().empty());
  std::map<std::string, std::string> parent;
  for (const auto& message : {fixed->messages().back(), moving->messages().back()}) {
    for (const auto& frame : message.transforms) {
      EXPECT_TRUE(parent.emplace(frame.child_frame_id, frame.header.frame_id).second)
          << frame.child_frame_id << " has two parents";
      const auto& q = frame.transform.rotation;
      EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-9);
    }
  }
  const CellDescription& cell = service_.model->description;
  for (const auto& component : cell.components) EXPECT_EQ(parent[component.name], "world") << component.name;
  for (const auto& robot : cell.robots) {
    EXPECT_EQ(parent[robot.name + "/base_link"], "world");
    EXPECT_EQ(robot.links.size(), robot.arm.joints.size() + 2U) << "base, links, tool0";
    for (const auto& link : robot.links) {
      std::string at = robot.name + "/" + link.name;
      for (int depth = 0; at != "world" && depth < 20; ++depth) at = parent[at];
      EXPECT_EQ(at, "world") << link.name;
    }
  }
  // The flange by the frames is where the robot's own kinematics has it: chained, from the world down.
  std::map<std::string, Pose> X;
  for (const auto& message : {fixed->messages().back(), moving->messages().back()}) {
    for (const auto& frame : message.transforms) {
      const auto& t = frame.transform;
      X[frame.child_frame_id] =
          Pose::from_quaternion({t.translation.x, t.translation.y, t.translation.z},
                                Quat(t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z));
    }
  }
  Pose X_WF;
  for (std::string at = "Robot2/tool0"; at != "world"; at = parent[at]) X_WF = X[at] * X_WF;
  ArmPoses poses;
  forward_kinematics(cell.robots[1].arm, service_.model->robots[1].q_initial.data(), poses);
  const Pose wanted = cell.robots[1].X_WR * poses.X_RF;
  EXPECT_LT((X_WF.p - wanted.p).norm(), 1e-12);
  EXPECT_LT((X_WF.R - wanted.R).norm(), 1e-12);
}

TEST_F(WireCommands, ARobotOfAFrozenOwnerPassesToTheNextSender) {
  test::ChildProcess owner({std::string(TAKT_BIN_DIR) + "/takt-test-commander",
                            std::to_string(test::test_domain()), test::test_cell(), "Robot1", "0.02", "2"});
  ASSERT_TRUE(owner.wait_for_output("ready")) << owner.text;
  step_until_applied(0, 1);
  client_->send_joint_command("Robot1", at(0.01));  // weaker: not heard
  owner.signal(SIGSTOP);
  const auto frozen = std::chrono::steady_clock::now();
  const auto applied = [](const State& s) { return s.applied[0].count >= 2; };
  bool taken_over = false;
  for (int attempt = 0; attempt < 6000 && !taken_over; ++attempt) {
    client_->send_joint_command("Robot1", at(0.01));
    client_->step(1);
    taken_over = client_->wait_for(takt::topics::state, applied, Seconds{0.01}).has_value();
  }
  const Seconds took = std::chrono::steady_clock::now() - frozen;
  EXPECT_TRUE(taken_over);
  RecordProperty("takeover_ms", static_cast<int>(1000.0 * took.count()));
  std::printf("takeover after %.2f s\n", took.count());
  const auto reported = client_->wait_for(
      takt::topics::event, [](const auto& e) { return e.code == "owner_silent"; }, kGenerous);
  ASSERT_TRUE(reported.has_value());
  EXPECT_EQ(reported->subject, "Robot1");
}

// The frozen process is killed at the end without being continued: it would take the ports of this one for
// dead and have them made again, which Fast DDS 2.9.1 does not survive during their destruction.

/// A controller that died, and restarts after its silence was detected. DDS itself would wait, silently, for
/// the end of the dead participant's lease.
TEST_F(WireCommands, ARobotOfAFrozenSoleOwnerPassesToALaterSender) {
  test::ChildProcess owner({std::string(TAKT_BIN_DIR) + "/takt-test-commander",
                            std::to_string(test::test_domain()), test::test_cell(), "Robot1", "0.02", "30"});
  ASSERT_TRUE(owner.wait_for_output("ready")) << owner.text;
  step_until_applied(0, 1);
  owner.signal(SIGSTOP);
  const double frozen_s = client_->status().wall_time;
  ASSERT_TRUE(client_->wait_for(
      takt::topics::status, [&](const auto& s) { return s.wall_time > frozen_s + 3.0; }, kGenerous));
  bool taken_over = false;
  for (int attempt = 0; attempt < 6000 && !taken_over; ++attempt) {
    client_->send_joint_command("Robot1", at(0.01));
    client_->step(1);
    taken_over =
        client_
            ->wait_for(
                takt::topics::state, [](const State& s) { return s.applied[0].count >= 2; }, Seconds{0.01})
            .has_value();
  }
  EXPECT_TRUE(taken_over);
  EXPECT_TRUE(client_->wait_for(
      takt::topics::event, [](const auto& e) { return e.code == "owner_silent"; }, kGenerous));
}

}  // namespace
}  // namespace takt
