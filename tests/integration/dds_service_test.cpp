// The service over DDS against raw endpoints: its samples, its refusals, and the ownership of targets.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "idl/common/utf8.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/loop_reader.h"

namespace takt {
namespace {

using test::DdsService;
using test::RawCellClient;
using test::RawWriter;
using test::swing;
namespace msg = takt_msgs::msg;
using JointStateType = sensor_msgs::msg::JointState;

RunLoopOptions paused(Pace pace = Pace::free) {
  RunLoopOptions options;
  options.pace = pace;
  options.state = SimulationState::paused;
  return options;
}

TEST(DdsService, TheServiceDescribesItselfAndPublishesItsInstants) {
  DdsService service(paused());
  RawCellClient client;
  const auto descriptions = client.dds.read<msg::CellDescription>(client.topic("description"), true, true, 1);
  ASSERT_TRUE(descriptions->wait_until([](const auto& messages) { return !messages.empty(); }));
  const msg::CellDescription description = descriptions->messages().front();
  EXPECT_EQ(description.cell, test::test_cell().c_str());
  EXPECT_EQ(description.scenario, "service_test");
  EXPECT_EQ(description.step_size, 0.001);
  ASSERT_EQ(description.robots.size(), 2U);
  EXPECT_EQ(description.robots[1].name, "Robot2");
  ASSERT_EQ(description.robots[0].joints.size(), 6U);
  EXPECT_EQ(description.robots[0].joints[0].name, "shoulder_pan_joint");
  ASSERT_EQ(description.grippers.size(), 2U);
  EXPECT_EQ(description.grippers[0].max_width, 0.15);
  const auto& cell = service.loop->cell();
  ASSERT_EQ(description.components.size(), cell.components.size());
  for (std::size_t i = 0; i < cell.components.size(); ++i) {
    EXPECT_EQ(description.components[i].name, cell.components[i].name);
    EXPECT_EQ(description.components[i].vertices, cell.components[i].mesh->vertices);
    EXPECT_EQ(description.components[i].triangles, cell.components[i].mesh->triangles);
  }

  const auto joints = client.dds.read<JointStateType>(client.topic("Robot2/joint_states"), true, false, 10);
  const auto clock = client.dds.read<rosgraph_msgs::msg::Clock>("rt/clock", true, false, 1);
  const auto urdf =
      client.dds.read<std_msgs::msg::String>(client.topic("Robot1/robot_description"), true, true, 1);
  ASSERT_TRUE(urdf->wait_until([](const auto& messages) { return !messages.empty(); }));
  EXPECT_EQ(urdf->messages().front().data, cell.robots[0].urdf);

  // The service discovers the two readers above only when their samples arrive; steps until they do.
  const auto any = [](const auto& messages) { return !messages.empty(); };
  std::uint64_t steps = 0;
  while (!joints->wait_briefly(any) || !clock->wait_briefly(any)) {
    ASSERT_EQ(client.request("step", {{"steps", "10"}}).result, 1);
    steps += 10;
  }
  ASSERT_TRUE(client.state->wait_for([&](const auto& state) { return state.step == steps; }));
  const auto state = client.state->messages().back();
  EXPECT_EQ(state.components.size(), cell.components.size());
  EXPECT_EQ(state.robots[0].position.size(), 6U);
  EXPECT_NEAR(state.time, static_cast<double>(steps) * 0.001, 1e-12);
  EXPECT_EQ(state.applied[2].target, "Gripper1");
  const auto joint_state = joints->messages().front();
  EXPECT_EQ(joint_state.name[0], "shoulder_pan_joint");
  EXPECT_NEAR(joint_state.position[1], -1.5707963267948966, 1e-9);
  service.stop();
  EXPECT_EQ(state.state_hash, service.simulation().state_hash());
}

TEST(DdsService, ALateReaderGetsTheInstantOfAnUnwatchedPause) {
  RunLoopOptions options;
  options.pace = Pace::free;
  options.pause_at_s = 0.3;
  DdsService service(options);
  test::RawDdsClient client(test::test_domain());
  // The status is no instant: its reader does not count as one of instants.
  const auto status = client.read<msg::Status>(RawCellClient::topic("status"), true, true, 1);
  ASSERT_TRUE(status->wait_for(
      [](const msg::Status& s) { return s.step == 300 && s.state == SimulationState::paused; }));
  const auto state = client.read<msg::CellState>(RawCellClient::topic("state"), false, false, 100);
  ASSERT_TRUE(state->wait_until([](const auto& messages) { return !messages.empty(); }));
  const auto first = state->messages().front();
  EXPECT_EQ(first.step, 300U);
  service.stop();
  EXPECT_EQ(first.state_hash, service.simulation().state_hash());
}

class DdsCommands : public testing::Test {
 protected:
  DdsCommands() {
    robot1_ = client_.dds.write<JointStateType>(client_.topic("Robot1/joint_commands"));
    gripper1_ = client_.dds.write<msg::GripperCommand>(client_.topic("Gripper1/command"));
    robot1_.matches->wait_for(1);
    gripper1_.matches->wait_for(1);
    // A writer discovers a reader earlier than the reader discovers the writer, and samples in between are
    // lost: sends empty commands until the service reports both.
    sensor_msgs::msg::JointState empty;
    msg::GripperCommand nonsense;
    nonsense.action = static_cast<GripperAction>(200);
    const auto complained = [](const std::string& subject) {
      return [subject](const std::vector<msg::Event>& events) {
        return std::any_of(events.begin(), events.end(),
                           [&](const msg::Event& event) { return event.subject == subject.c_str(); });
      };
    };
    for (int attempt = 0; attempt < 600; ++attempt) {
      robot1_.writer->write(&empty);
      gripper1_.writer->write(&nonsense);
      if (client_.events->wait_briefly(complained("Robot1")) &&
          client_.events->wait_briefly(complained("Gripper1"))) {
        break;
      }
    }
  }
  sensor_msgs::msg::JointState good() const { return test::to_message(arm(), swing(0, 0.0), 0.0); }
  const ArmModel& arm() const { return service_.loop->cell().robots[0].arm; }

  void expect_rejected(sensor_msgs::msg::JointState message, const std::string& words) {
    robot1_.writer->write(&message);
    msg::Event event;
    ASSERT_TRUE(client_.wait_for_event("command_rejected", "Robot1", words, &event)) << words;
    EXPECT_EQ(event.sender, robot1_.guid());
  }
  void expect_rejected(msg::GripperCommand message, const std::string& words) {
    gripper1_.writer->write(&message);
    msg::Event event;
    ASSERT_TRUE(client_.wait_for_event("command_rejected", "Gripper1", words, &event)) << words;
    EXPECT_EQ(event.sender, gripper1_.guid());
  }

  /// Sends the command and steps until a state shows that this sender is accepted: a writer discovers a
  /// reader earlier than the reader discovers the writer. Returns the number of commands applied to Robot1 by
  /// then.
  std::uint64_t command_until_applied(RawWriter& writer, sensor_msgs::msg::JointState message) {
    const auto applied = [&] { return client_.state->messages().back().applied[0].count; };
    const std::uint64_t before = applied();
    for (int attempt = 0; attempt < 600 && applied() == before; ++attempt) {
      writer.writer->write(&message);
      EXPECT_EQ(client_.request("step").result, 1);
      (void)client_.state->wait_briefly(
          [&](const auto& messages) { return messages.back().applied[0].count > before; });
    }
    EXPECT_GT(applied(), before);
    return applied();
  }
  /// Sends the command until an event reports that its sender has no effect.
  bool send_until_told(RawWriter& writer, sensor_msgs::msg::JointState message, const std::string& words,
                       msg::Event* found = nullptr) {
    const auto reported = [&](const auto& events) {
      return std::any_of(events.begin(), events.end(), [&](const msg::Event& event) {
        return event.code == "not_owner" && event.message.find(words) != std::string::npos;
      });
    };
    for (int attempt = 0; attempt < 600; ++attempt) {
      writer.writer->write(&message);
      if (client_.events->wait_briefly(reported)) break;
    }
    return client_.wait_for_event("not_owner", "Robot1", words, found);
  }
  double robot1_position(std::uint64_t after_steps) {
    const auto reply = client_.request("step", {{"steps", std::to_string(after_steps)}});
    const std::uint64_t step = std::stoull(client_.value(reply, "step"));
    msg::CellState state;
    EXPECT_TRUE(client_.state->wait_for([&](const auto& s) { return s.step == step; }, &state));
    return state.robots.at(0).position.at(0);
  }

  DdsService service_{paused()};
  RawCellClient client_;
  RawWriter robot1_, gripper1_;
};

TEST_F(DdsCommands, InvalidCommandsAreRejectedWithTheReasonAndChangeNothing) {
  auto bad = good();
  bad.position[2] = std::numeric_limits<double>::quiet_NaN();
  expect_rejected(bad, "not_finite: position of joint 'elbow_joint'");
  bad = good();
  bad.velocity[1] = std::numeric_limits<double>::infinity();
  expect_rejected(bad, "not_finite: velocity of joint 'shoulder_lift_joint'");
  bad = good();
  bad.position.pop_back();
  expect_rejected(bad, "wrong_count: field 'position' has 5");
  bad = good();
  bad.name.push_back("one_more");
  expect_rejected(bad, "wrong_count: field 'name' has 7");
  bad = good();
  bad.name[0] = "no_such_joint";
  expect_rejected(bad, "unknown_joint: Robot1 has no joint 'no_such_joint'");
  bad = good();
  bad.name[0] = bad.name[1];
  expect_rejected(bad, "duplicate_joint");
  bad = good();
  bad.position[0] = 100.0;
  expect_rejected(bad, "out_of_range: position 100 rad of joint 'shoulder_pan_joint'");
  bad = good();
  bad.velocity[0] = 100.0;
  expect_rejected(bad, "velocity_out_of_range");
  bad = good();
  bad.header.stamp.nanosec = 2'000'000'000U;
  expect_rejected(bad, "malformed: the stamp");
  msg::GripperCommand gripper;
  gripper.action = static_cast<GripperAction>(9);
  expect_rejected(gripper, "malformed: action 9");
  gripper.action = static_cast<GripperAction>(2);
  gripper.width = 0.2;
  expect_rejected(gripper, "out_of_range: width 0.2");
  gripper.width = std::numeric_limits<double>::quiet_NaN();
  expect_rejected(gripper, "not_finite: width");

  ASSERT_EQ(client_.request("step", {{"steps", "50"}}).result, 1);
  const std::size_t rejected = client_.count_events("command_rejected");
  EXPECT_GE(rejected, 14U);  // the twelve above, and those at the start
  ASSERT_TRUE(client_.status->wait_for([&](const msg::Status& status) {
    return status.step == 50 && status.commands_rejected == rejected && status.commands_applied == 0;
  }));
  service_.stop();
  Simulation untouched(service_.model);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(untouched.step({}));
  EXPECT_EQ(service_.simulation().state_hash(), untouched.state_hash());
}

TEST_F(DdsCommands, StaleCommandsAreRejected) {
  auto message = test::to_message(arm(), swing(0, 0.0), 2.0);
  robot1_.writer->write(&message);
  expect_rejected(test::to_message(arm(), swing(0, 0.0), 1.5), "stale: ");
}

TEST_F(DdsCommands, CommandsForUnknownRobotsAreReported) {
  const auto ghost = client_.dds.write<JointStateType>(client_.topic("Robot9/joint_commands"));
  const auto hand = client_.dds.write<msg::GripperCommand>(client_.topic("Hand/command"));
  msg::Event event;
  ASSERT_TRUE(client_.wait_for_event("unknown_robot", "Robot9", "robots: Robot1, Robot2", &event));
  EXPECT_EQ(event.sender, ghost.guid());
  ASSERT_TRUE(
      client_.wait_for_event("unknown_gripper", "Hand", "grippers: Gripper1, Gripper2; devices: none."));
  const auto oven = client_.dds.write<msg::DeviceCommand>(client_.topic("Oven/command"));
  ASSERT_TRUE(
      client_.wait_for_event("unknown_device", "Oven", "there is no gripper or device 'Oven'", &event));
  EXPECT_EQ(event.sender, oven.guid());
}

TEST_F(DdsCommands, AWriterOfAnotherTypeIsReported) {
  const auto text = client_.dds.write<std_msgs::msg::String>(client_.topic("Robot2/joint_commands"));
  msg::Event event;
  ASSERT_TRUE(client_.wait_for_event("wrong_type", "Robot2", "std_msgs/msg/String", &event));
  EXPECT_EQ(event.sender, text.guid());
  EXPECT_EQ(event.severity, Severity::warning);
  EXPECT_NE(event.message.find("takes sensor_msgs/msg/JointState."), std::string::npos) << event.message;
  const auto gripper = client_.dds.write<msg::DeviceCommand>(client_.topic("Gripper2/command"));
  ASSERT_TRUE(client_.wait_for_event("wrong_type", "Gripper2", "takes takt_msgs/msg/GripperCommand."));
  const auto path = client_.dds.write<JointStateType>(client_.topic("Robot1/joint_trajectory"));
  ASSERT_TRUE(client_.wait_for_event("wrong_type", "Robot1", "takes trajectory_msgs/msg/JointTrajectory."));
  // Writers of the right types are not reported.
  EXPECT_EQ(client_.count_events("wrong_type"), 3U);
}

/// Programs that read events as JSON or in Python take text in UTF-8 only, and terminals obey the rest.
TEST_F(DdsCommands, CommandsWithInvalidUtf8AreReportedInUtf8) {
  auto bad = good();
  bad.name[0] = "x\"\\\n\xFF\x1B[2J";
  expect_rejected(bad, "has no joint 'x\"\\???[2J'");
  bad.name[0] = std::string(99, 'x') + "\xC3\xA4";  // cut within a character
  expect_rejected(bad, "xx?'");
  const auto reply = client_.request("sto\xFFp", {{"a\nb", "1"}});
  EXPECT_EQ(reply.result, 4);
  EXPECT_NE(reply.message.find("'sto?p' is no text"), std::string::npos);
  const auto value = client_.request("explain_part", {{"part", "P\xED\xA0\x80"}});
  EXPECT_EQ(value.result, 4);
  EXPECT_NE(value.message.find("is no text: 'P?"), std::string::npos) << value.message;
  client_.write("step", {}, 7000, "raw\xFF");
  ASSERT_TRUE(client_.wait_for_replies(7000, 1));
  EXPECT_EQ(client_.replies().back().client_id, "raw?");
  EXPECT_EQ(client_.replies().back().result, 4);
  for (const auto& event : client_.events->messages()) {
    for (const std::string& text : {event.subject, event.sender, event.message})
      EXPECT_TRUE(validate_utf8(text)) << text;
  }
  for (const auto& one : client_.replies()) EXPECT_TRUE(validate_utf8(one.message, LineBreaks::allow));
}

TEST_F(DdsCommands, TheFirstOfTwoSharedSendersIsHeardUntilItLeaves) {
  command_until_applied(robot1_, good());
  auto second = client_.dds.write<JointStateType>(client_.topic("Robot1/joint_commands"));
  ASSERT_TRUE(second.matches->wait_for(1));
  auto other = good();
  other.position[0] = 0.01;
  msg::Event event;
  ASSERT_TRUE(send_until_told(second, other, robot1_.guid(), &event));
  EXPECT_EQ(event.sender, second.guid());
  EXPECT_NEAR(robot1_position(20), 0.0, 1e-12);

  client_.dds.remove(robot1_);
  command_until_applied(second, other);
  EXPECT_NEAR(robot1_position(20), 0.01, 1e-12);
}

TEST_F(DdsCommands, ExclusiveSendersComeFirstAndTheStrongestOfThem) {
  auto message = good();
  auto weak = client_.dds.write<JointStateType>(client_.topic("Robot1/joint_commands"), true, 1);
  message.position[0] = 0.01;
  command_until_applied(weak, message);
  auto shared = good();
  ASSERT_TRUE(send_until_told(robot1_, shared, weak.guid()));
  EXPECT_NEAR(robot1_position(20), 0.01, 1e-12);

  auto strong = client_.dds.write<JointStateType>(client_.topic("Robot1/joint_commands"), true, 5);
  msg::Event event;
  ASSERT_TRUE(client_.wait_for_event("not_owner", "Robot1", "exclusively", &event));
  EXPECT_EQ(event.sender, weak.guid());
  message.position[0] = 0.02;
  command_until_applied(strong, message);
  // A step takes what is still under way.
  ASSERT_TRUE(is_ok(strong.writer->wait_for_acknowledgments(DdsDuration(60, 0))));
  robot1_position(1);
  const std::uint64_t applied = client_.state->messages().back().applied[0].count;
  // From here on DDS itself drops the samples of the weaker one.
  message.position[0] = 0.01;
  for (int i = 0; i < 20; ++i) weak.writer->write(&message);
  EXPECT_NEAR(robot1_position(20), 0.02, 1e-12);
  EXPECT_EQ(client_.state->messages().back().applied[0].count, applied);

  // It goes, and the weaker one takes over.
  client_.dds.remove(strong);
  command_until_applied(weak, message);
  EXPECT_NEAR(robot1_position(20), 0.01, 1e-12);
}

/// A killed sender sends no farewell: the lease of its participant decides.
TEST_F(DdsCommands, TheNextSenderTakesOverFromAKilledOwner) {
  test::ChildProcess owner({std::string(TAKT_BIN_DIR) + "/takt-test-commander",
                            std::to_string(test::test_domain()), test::test_cell(), "Robot1", "0.02"});
  ASSERT_TRUE(owner.wait_for_output("ready")) << owner.text;
  const auto applied = [&] { return client_.state->messages().back().applied[0].count; };
  for (int attempt = 0; attempt < 600 && applied() == 0; ++attempt) {
    ASSERT_EQ(client_.request("step").result, 1);
    (void)client_.state->wait_briefly([](const auto& m) { return m.back().applied[0].count > 0; });
  }
  EXPECT_NEAR(robot1_position(20), 0.02, 1e-12);
  owner.signal(SIGKILL);
  EXPECT_EQ(owner.wait(), 128 + SIGKILL);
  auto next = client_.dds.write<JointStateType>(client_.topic("Robot1/joint_commands"), true, 1);
  auto message = good();
  message.position[0] = 0.01;
  command_until_applied(next, message);
  EXPECT_NEAR(robot1_position(20), 0.01, 1e-12);
}

TEST(DdsControl, RepliesGoToTheirRequester) {
  DdsService service(paused());
  RawCellClient client;
  // The same number for another request: two clients of one id, or a restarted one.
  client.write("step", {{"steps", "5"}}, 6000);
  ASSERT_TRUE(client.wait_for_replies(6000, 1));
  client.write("step", {{"steps", "7"}}, 6000);
  ASSERT_TRUE(client.wait_for_replies(6000, 2));
  EXPECT_EQ(client.replies().back().result, 4);
  EXPECT_NE(client.replies().back().message.find("an id of its own"), std::string::npos);
  EXPECT_EQ(client.value(client.request("get_state"), "step"), "5");
  client.write("step", {{"steps", "3"}}, 6001, "");
  ASSERT_TRUE(client.wait_for_replies(6001, 1));
  EXPECT_EQ(client.replies().back().result, 4);
  EXPECT_NE(client.replies().back().message.find("client_id"), std::string::npos);
  EXPECT_EQ(client.value(client.request("get_state"), "step"), "5");
}

TEST(DdsControl, RequestsAreAnsweredOnce) {
  DdsService service(paused());
  RawCellClient client;
  EXPECT_EQ(client.request("no_such_request").result, 0);
  const auto unknown = client.request("step", {{"count", "3"}});
  EXPECT_EQ(unknown.result, 4);
  EXPECT_NE(unknown.message.find("'count'"), std::string::npos);
  client.write("step", {{"steps", "5"}}, 5000);
  ASSERT_TRUE(client.wait_for_replies(5000, 1));
  client.write("step", {{"steps", "5"}}, 5000);  // as a client does that has not heard the reply
  ASSERT_TRUE(client.wait_for_replies(5000, 2));
  const auto state = client.request("get_state");
  EXPECT_EQ(client.value(state, "step"), "5");
  EXPECT_EQ(client.value(state, "state"), "paused");
  EXPECT_EQ(client.request("set_state", {{"state", "1"}}).result, 1);
  EXPECT_EQ(client.request("step").result, 3);
}

TEST(DdsLockstep, LockstepGivesTheBitsOfDirectSteps) {
  constexpr std::uint64_t kSteps = 480;
  constexpr double kPeriod = 0.008;
  std::vector<std::uint64_t> served;
  RunLoopOptions options = paused(Pace::lockstep);
  options.pause_at_s = static_cast<double>(kSteps) * 0.001;
  options.on_instant = [&](const Simulation& simulation) { served.push_back(simulation.state_hash()); };
  DdsService service(options);
  RawCellClient client;
  auto robot1 = client.dds.write<JointStateType>(client.topic("Robot1/joint_commands"), true, 1);
  auto robot2 = client.dds.write<JointStateType>(client.topic("Robot2/joint_commands"));
  auto gripper = client.dds.write<msg::GripperCommand>(client.topic("Gripper2/command"), true, 1);
  for (auto* writer : {&robot1, &robot2, &gripper}) ASSERT_TRUE(writer->matches->wait_for(1));
  ASSERT_EQ(client
                .request("register_controller",
                         {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1,Robot2,Gripper2"}})
                .result,
            1);
  ASSERT_EQ(client.request("set_state", {{"state", "1"}}).result, 1);
  const auto& cell = service.loop->cell();
  for (std::uint64_t step = 0; step < kSteps; step += 8) {
    msg::CellState state;
    ASSERT_TRUE(client.state->wait_for([&](const auto& s) { return s.step == step; }, &state)) << step;
    auto first = test::to_message(cell.robots[0].arm, swing(0, state.time), state.time);
    auto second = test::to_message(cell.robots[1].arm, swing(1, state.time), state.time);
    msg::GripperCommand close;
    close.stamp = state.stamp;
    close.action = static_cast<GripperAction>(1);
    gripper.writer->write(&close);
    robot2.writer->write(&second);
    robot1.writer->write(&first);
  }
  ASSERT_TRUE(client.wait_for_event("end_of_scenario", "service_test", ""));
  service.stop();

  Simulation direct(service.model);
  std::vector<std::uint64_t> expected{direct.state_hash()};
  while (direct.step_index() < kSteps) {
    std::vector<Command> commands;
    if (direct.step_index() % 8 == 0) {
      for (int robot = 0; robot < 2; ++robot) {
        JointCommand command = swing(robot, direct.time_s());
        command.period_s = kPeriod;
        commands.emplace_back(command);
      }
      commands.emplace_back(
          GripperCommand{1, SimTime::from_seconds(direct.time_s()), GripperAction::close, 0.0, 0.0});
    }
    ASSERT_TRUE(direct.step(commands));
    expected.push_back(direct.state_hash());
  }
  EXPECT_EQ(served, expected);
  EXPECT_EQ(client.count_events("command_rejected"), 0U);
}

TEST(DdsDescription, ADescriptionOfMegabytesReachesALateJoiner) {
  auto model = test::service_model();
  DescribedMesh mesh;
  const std::size_t triangles = 60'000;  // 12 bytes of indices each, and 24 bytes of vertices: 2.2 MB
  mesh.vertices.assign(triangles * 6, 0.0F);
  mesh.triangles.assign(triangles * 3, 0U);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) mesh.vertices[i] = static_cast<float>(i);
  model->description.components[0].mesh = std::make_shared<const DescribedMesh>(mesh);
  DdsService service(paused(), model);
  RawCellClient client;
  const auto inbox = client.dds.read<msg::CellDescription>(client.topic("description"), true, true, 1);
  ASSERT_TRUE(inbox->wait_until([](const auto& messages) { return !messages.empty(); }));
  EXPECT_EQ(inbox->messages().front().components[0].vertices, mesh.vertices);
}

/// More fragments than a request for missing ones can name (256), and more than shared memory has room for.
TEST(DdsDescription, ADescriptionOfMillionsOfTrianglesReachesOtherProcesses) {
  auto model = test::service_model();
  DescribedMesh mesh;
  const std::size_t triangles = 2'000'000;
  mesh.vertices.assign(triangles * 3 / 2, 0.5F);  // 36 MB
  mesh.triangles.assign(triangles * 3, 7U);
  DdsService service(paused(), model);
  for (int i = 0; i < 3; ++i) {
    test::ChildProcess looker({std::string(TAKT_BIN_DIR) + "/takt", "state", "--json", "--timeout", "60",
                               "--cell", test::test_cell(), "--domain", std::to_string(test::test_domain())});
    EXPECT_EQ(looker.wait(), 0) << looker.text;
  }
}

}  // namespace
}  // namespace takt
