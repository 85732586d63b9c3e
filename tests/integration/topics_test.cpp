// Every topic of the table, read by its type from a server: Client::wait_for, and `takt echo`.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "idl/common/cdr.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"
#include "tests/support/service_cell.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::Topic;
using takt::test::ChildProcess;
using takt::test::client_options;
using takt::test::DdsService;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::kBin;
using takt::test::kGenerous;

/// A cell in which each topic has content: power, surface contact, a pair whose pressures a client watches, an event.
DdsService busy_cell() {
  takt::RunLoopOptions options;
  options.state = takt::SimulationState::paused;
  return DdsService(options, takt::test::service_contact_model(
                                 takt::test::test_cell(), "force_torque_sensors: {FT1: {robot: Robot1}}\n"));
}

std::string element_of(const takt::TopicInfo& topic) {
  if (!topic.of_element()) return {};
  return topic.element_kind() == "device" ? "FT1" : "Robot1";
}

void make_busy(Client& client) {
  client.set_level_of_detail(3);
  client.call(takt::requests::WatchPressures{{"P-Table1"}, 86400.0});
  client.step(200);
}

TEST(EveryTopic, IsReadByItsType) {
  const DdsService service = busy_cell();
  Client client(client_options());
  make_busy(client);
  client.play();
  std::vector<std::string> read;
  takt::topics::for_each([&]<typename Type>(const Topic<Type>& topic) {
    if (!topic.is_for_clients()) {
      EXPECT_THROW((void)client.wait_for(topic), ClientError) << topic.id;
      return;
    }
    const auto sample = client.wait_for(topic, kGenerous, element_of(topic));
    ASSERT_TRUE(sample.has_value()) << topic.id;
    EXPECT_FALSE(static_cast<const Type&>(*sample) == Type{}) << topic.id;
    EXPECT_GE(sample->sample_number, 1U) << topic.id;
    if constexpr (!std::is_same_v<takt::SampleOf<Type>, takt::CellInfo>) {
      EXPECT_EQ(sample->cell, client.cell()) << topic.id;
    }
    read.emplace_back(topic.id);
  });
  EXPECT_EQ(read, (std::vector<std::string>{"robot_description", "joint_states", "clock", "wrench", "tf",
                                            "tf_static", "state", "power", "contacts", "contact_pressures",
                                            "event", "description", "status"}));
}

TEST(EveryTopic, IsEchoedAsJson) {
  const DdsService service = busy_cell();
  Client client(client_options());
  make_busy(client);
  const auto takt = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), std::string(kBin) + "/takt");
    arguments.insert(arguments.end(), {"--cell", takt::test::test_cell(), "--domain",
                                       std::to_string(takt::test::test_domain()), "--timeout", "60"});
    return arguments;
  };
  ChildProcess contacts(takt({"echo", "contacts", "--count", "2"}));
  ASSERT_EQ(contacts.wait(), 0) << contacts.text;
  const std::string line = contacts.text.substr(0, contacts.text.find('\n'));
  const auto sample = nlohmann::json::parse(line);
  EXPECT_EQ(sample["step"], 200);
  EXPECT_EQ(sample["contacts"].size(), 2U);
  EXPECT_EQ(contacts.text, line + "\n" + line + "\n");  // of a cell that stands
  ChildProcess description(takt({"echo", "robot_description", "Robot2"}));
  EXPECT_EQ(description.wait(), 0) << description.text;
  EXPECT_NE(description.text.find("<robot"), std::string::npos) << description.text.substr(0, 200);
  ChildProcess unknown(takt({"echo", "contact"}));
  EXPECT_EQ(unknown.wait(), 2);
  expect_words(unknown.text, {"contact_pressures", "joint_states"});
}

TEST(EveryTopic, BelongsToTheScenarioThatIsLoaded) {
  HostedService service;
  Client client(client_options());
  const auto has_frame = [](const std::string& name) {
    return [name](const auto& message) {
      return std::ranges::any_of(message.transforms, [&](const auto& frame) {
        return frame.child_frame_id.starts_with(name + "/");
      });
    };
  };
  using namespace takt::topics;
  ASSERT_TRUE(client.wait_for(tf_static, has_frame("Robot1"), kGenerous));
  ASSERT_TRUE(client.wait_for(joint_states, kGenerous, "Robot2"));
  client.load_scenario(service.one_arm());
  // Sent once, and perhaps received earlier than the description.
  EXPECT_TRUE(client.wait_for(tf_static, has_frame("Arm"), kGenerous));
  EXPECT_TRUE(client.wait_for(robot_description, kGenerous, "Arm"));
  const auto joints = client.wait_for(joint_states, kGenerous, "Arm");
  ASSERT_TRUE(joints);
  EXPECT_EQ(joints->position.size(), 6U);
  EXPECT_EQ(joints->cell->robots.size(), 1U);
  try {
    (void)client.wait_for(joint_states, kGenerous, "Robot2");
    ADD_FAILURE() << "Robot2 is there";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::not_found);
    expect_words(error.what(), {"no robot 'Robot2'", "Arm"});
  }
}

}  // namespace
