// Samples sent by takt::Client: commands and control requests, and its refusals.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <future>
#include <limits>

#include "client_lib/client.h"
#include "client_lib/raw_topics.h"
#include "tests/support/hosting_client.h"
#include "tests/support/scripted_cell.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::GripperAction;
using takt::Seconds;
using takt::SimulationState;
using takt::test::kGenerous;
using takt::test::ScriptedCell;
using takt::test::small_description;
using takt::test::test_domain;
using takt::test::unique_cell_name;

class ClientCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() { ScriptedCell::use_real_transports(); }

  void connect(ScriptedCell::Handler handler = {}, Seconds timeout = kGenerous) {
    server_ = std::make_unique<ScriptedCell>(name_, small_description(name_), std::move(handler));
    takt::ClientOptions options;
    options.cell = name_;
    options.domain = static_cast<int>(test_domain());
    options.timeout = kGenerous;
    options.liveliness_timeout = kGenerous;
    options.timeout = timeout;
    // The time that calls wait is also that to connect.
    for (Seconds waited = timeout; !client_; waited += timeout) {
      try {
        client_ = std::make_unique<Client>(options);
      } catch (const ClientError&) {
        if (waited >= kGenerous) throw;
      }
    }
  }
  template <typename Call>
  ClientError error_of(Call call) {
    try {
      call();
    } catch (const ClientError& error) {
      return error;
    }
    ADD_FAILURE() << "no error was thrown";
    return {ClientError::Kind::transport, ""};
  }

  std::string name_ = unique_cell_name("commanded");
  std::unique_ptr<ScriptedCell> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(ClientCommand, TheFirstJointCommandArrivesExactly) {
  connect();
  server_->listen_to_joints("Robot2");
  client_->send_joint_command("Robot2", {0.1, -1.0 / 3.0}, {1e-300, 2.0}, 12.000000008, {-7.5, 1.0 / 3.0});
  const auto received = server_->wait_for_joint_commands(1);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].name, (std::vector<std::string>{"shoulder", "elbow"}));
  EXPECT_EQ(received[0].position, (std::vector<double>{0.1, -1.0 / 3.0}));
  EXPECT_EQ(received[0].velocity, (std::vector<double>{1e-300, 2.0}));
  EXPECT_EQ(received[0].effort, (std::vector<double>{-7.5, 1.0 / 3.0}));
  EXPECT_EQ(received[0].header.stamp.sec, 12);
  EXPECT_EQ(received[0].header.stamp.nanosec, 8U);
}

TEST_F(ClientCommand, TorquesArriveAsEffortsAlone) {
  connect();
  server_->listen_to_joints("Robot2");
  client_->send_joint_torques("Robot2", {-7.5, 1.0 / 3.0}, 12.0);
  const auto received = server_->wait_for_joint_commands(1);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].name, (std::vector<std::string>{"shoulder", "elbow"}));
  EXPECT_TRUE(received[0].position.empty());
  EXPECT_TRUE(received[0].velocity.empty());
  EXPECT_EQ(received[0].effort, (std::vector<double>{-7.5, 1.0 / 3.0}));
  EXPECT_EQ(received[0].header.stamp.sec, 12);
  EXPECT_EQ(error_of([&] { client_->send_joint_torques("Robot2", {1.0}); }).kind(),
            ClientError::Kind::invalid);
  EXPECT_EQ(error_of([&] {
              client_->send_joint_torques("Robot2", {1.0, NAN});
            }).kind(),
            ClientError::Kind::invalid);
}

TEST_F(ClientCommand, AGripperCommandArrives) {
  connect();
  server_->listen_to_gripper("Gripper1");
  client_->set_gripper("Gripper1", GripperAction::width, 0.03, 40.0);
  const auto received = server_->wait_for_gripper_commands(1);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].action, GripperAction::width);
  EXPECT_EQ(received[0].width, 0.03);
  EXPECT_EQ(received[0].max_force, 40.0);
  EXPECT_EQ(received[0].stamp.sec, 0);
  EXPECT_EQ(received[0].stamp.nanosec, 0U);
}

TEST_F(ClientCommand, CommandsForSeveralTargetsAreOneSample) {
  connect();
  server_->listen_to_commands();
  client_->send_together([&] {
    client_->send_joint_command("Robot2", {0.1, 0.2}, {}, 1.0);
    client_->set_gripper("Gripper1", GripperAction::close, 0.0, 40.0, 1.0);
    client_->send_joint_command("Robot1", {0.3, 0.4}, {}, 1.0);
  });
  EXPECT_THROW(client_->send_together([&] {
    client_->send_joint_command("Robot2", {0.1, 0.2});
    client_->send_joint_command("Robot7", {0.1, 0.2});
  }),
               ClientError)
      << "none of both is sent";
  client_->send_together([] {});
  client_->send_together([&] { client_->set_gripper("Gripper1", GripperAction::open); });
  const auto received = server_->wait_for_commands(2);
  ASSERT_EQ(received.size(), 2U);
  ASSERT_EQ(received[0].robots.size(), 2U);
  EXPECT_EQ(received[0].robots[0].robot, "Robot2");
  EXPECT_EQ(received[0].robots[0].command.position, (std::vector<double>{0.1, 0.2}));
  EXPECT_EQ(received[0].robots[1].robot, "Robot1");
  EXPECT_EQ(received[0].robots[1].command.header.stamp.sec, 1);
  ASSERT_EQ(received[0].grippers.size(), 1U);
  EXPECT_EQ(received[0].grippers[0].gripper, "Gripper1");
  EXPECT_EQ(received[0].grippers[0].command.max_force, 40.0);
  EXPECT_TRUE(received[1].robots.empty());
  EXPECT_EQ(received[1].grippers.at(0).command.action, GripperAction::open);
}

TEST_F(ClientCommand, InvalidCommandsAreRejectedByTheClient) {
  connect();
  server_->listen_to_joints("Robot1");
  const ClientError robot = error_of([&] { client_->send_joint_command("Robot7", {0.0, 0.0}); });
  EXPECT_EQ(robot.kind(), ClientError::Kind::not_found);
  EXPECT_STREQ(robot.what(), "The cell has no robot 'Robot7'; it has Robot1, Robot2.");

  const ClientError count = error_of([&] { client_->send_joint_command("Robot1", {0.0, 0.0, 0.0}); });
  EXPECT_EQ(count.kind(), ClientError::Kind::invalid);
  EXPECT_NE(std::string(count.what()).find("2 joints (shoulder, elbow); the command has 3 positions"),
            std::string::npos)
      << count.what();
  EXPECT_EQ(error_of([&] {
              client_->send_joint_command("Robot1", {0.0, 0.0}, {0.0});
            }).kind(),
            ClientError::Kind::invalid);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  const ClientError finite = error_of([&] { client_->send_joint_command("Robot1", {0.0, nan}); });
  EXPECT_EQ(finite.kind(), ClientError::Kind::invalid);
  EXPECT_NE(std::string(finite.what()).find("'elbow'"), std::string::npos) << finite.what();
  EXPECT_EQ(error_of([&] {
              client_->send_joint_command("Robot1", {0.0, 0.0}, {}, -1.0);
            }).kind(),
            ClientError::Kind::invalid);
  EXPECT_EQ(error_of([&] {
              client_->send_joint_command("Robot1", {0.0, 0.0}, {}, {}, {1.0});
            }).kind(),
            ClientError::Kind::invalid);
  const ClientError effort = error_of([&] {
    client_->send_joint_command("Robot1", {0.0, 0.0}, {}, {}, {1.0, nan});
  });
  EXPECT_EQ(effort.kind(), ClientError::Kind::invalid);
  EXPECT_NE(std::string(effort.what()).find("effort of joint 'elbow'"), std::string::npos) << effort.what();
  EXPECT_EQ(error_of([&] { client_->set_gripper("Gripper9", GripperAction::open); }).kind(),
            ClientError::Kind::not_found);
  EXPECT_EQ(error_of([&] { client_->set_gripper("Gripper1", GripperAction::width, INFINITY); }).kind(),
            ClientError::Kind::invalid);

  client_->send_joint_command("Robot1", {0.25, 0.5});
  const auto received = server_->wait_for_joint_commands(1);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].position, (std::vector<double>{0.25, 0.5}));
}

TEST_F(ClientCommand, ACommandWithoutAListenerIsAnError) {
  connect({}, Seconds{5.0});
  const ClientError error = error_of([&] { client_->send_joint_command("Robot1", {0.0, 0.0}); });
  EXPECT_EQ(error.kind(), ClientError::Kind::timeout);
  EXPECT_NE(std::string(error.what()).find("Robot1/joint_commands"), std::string::npos) << error.what();
}

TEST_F(ClientCommand, ARecorderOfCommandsIsNoListener) {
  connect({}, Seconds{5.0});
  takt::ClientOptions options;
  options.cell = name_;
  options.domain = static_cast<int>(test_domain());
  takt::client::RawTopics* opening = nullptr;
  std::promise<void> ready, recorded;
  takt::client::RawTopics recorder(
      options,
      [&, begun = ready.get_future().share()](const takt::client::RawTopic& topic) {
        begun.wait();
        if (topic.name.ends_with("joint_commands")) opening->open(topic.name, 1);
      },
      [&](const takt::client::RawTopic&, std::string_view) { recorded.set_value(); });
  opening = &recorder;
  ready.set_value();
  // With the recorder, and without the server: the first of these makes the topic.
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(error_of([&] {
                client_->send_joint_command("Robot1", {0.0, 0.0});
              }).kind(),
              ClientError::Kind::timeout);
  server_->listen_to_joints("Robot1");
  client_->send_joint_command("Robot1", {0.25, 0.5});
  EXPECT_EQ(server_->wait_for_joint_commands(1).size(), 1U);
  EXPECT_EQ(recorded.get_future().wait_for(std::chrono::duration_cast<std::chrono::seconds>(kGenerous)),
            std::future_status::ready);
}

TEST_F(ClientCommand, RequestsCarryTheirArgumentsAndBringTheReply) {
  connect([](ScriptedCell& cell, const takt_msgs::msg::ControlRequest& request) {
    if (request.request == "get_state") return cell.reply(request, 1, "Paused.", {{"state", "paused"}});
    std::map<std::string, std::string> echo;
    for (const auto& argument : request.arguments) echo[argument.name] = takt::text_of(argument.value);
    auto foreign = request;  // the reply to another client must not be taken for this one's
    foreign.client_id = "somebody else";
    cell.reply(foreign, 4, "not for you");
    cell.reply(request, 1, "Done: " + request.request, echo);
  });
  EXPECT_EQ(client_->get_state(), SimulationState::paused);
  const auto reply = client_->request("anything", {{"a", "1"}, {"b", "two words"}});
  EXPECT_EQ(reply.message, "Done: anything");
  EXPECT_EQ(reply.values.size(), 2U);
  EXPECT_EQ(reply.text("a"), "1");
  EXPECT_EQ(reply.text("b"), "two words");
}

TEST_F(ClientCommand, ARefusalCarriesResultAndSentenceOfTheServer) {
  connect([](ScriptedCell& cell, const takt_msgs::msg::ControlRequest& request) {
    if (request.request == "get_state") return cell.reply(request, 1, "Playing.", {{"state", "playing"}});
    cell.reply(request, 3, "Single steps are possible only while the simulation is paused.");
  });
  const ClientError error = error_of([&] { client_->step(5); });
  EXPECT_EQ(error.kind(), ClientError::Kind::refused);
  EXPECT_EQ(error.result(), takt::ControlResult::incorrect_state);
  EXPECT_NE(std::string(error.what()).find("only while the simulation is paused"), std::string::npos)
      << error.what();
}

TEST_F(ClientCommand, ARequestWithoutReplyTimesOut) {
  connect();                            // answers get_state only
  (void)client_->request("get_state");  // opens the control topics, which may take longer
  const ClientError error = error_of([&] { client_->request("step", {{"steps", "1"}}, Seconds{1.0}); });
  EXPECT_EQ(error.kind(), ClientError::Kind::timeout);
  EXPECT_NE(std::string(error.what()).find("'step'"), std::string::npos) << error.what();
}

}  // namespace
