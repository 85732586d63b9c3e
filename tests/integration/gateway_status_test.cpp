// A gateway in the status of its cell: its other side comes and goes, then the gateway itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tests/support/gateway_cell.h"

namespace takt::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using GatewayStatus = takt_msgs::msg::GatewayStatus;

/// The gateway in a status for which this is true of it; nothing if it never comes.
template <class Predicate>
std::optional<GatewayStatus> gateway_that(Client& client, const Predicate& fits) {
  const auto status = client.wait_for(
      topics::status, [&](const Status& s) { return s.gateways.size() == 1 && fits(s.gateways[0]); });
  return status ? std::optional(status->gateways[0]) : std::nullopt;
}

bool has_event(Client& client, const std::string& code, const std::string& subject) {
  return client
      .wait_for(topics::event,
                [&](const auto& event) { return event.code == code && event.subject == subject; })
      .has_value();
}

TEST(GatewayStatus, ShowsAGatewayItsPeerAndTheEndOfBoth) {
  GatewayCell cell(kBlockScenario);
  EXPECT_TRUE(cell.client().status().gateways.empty());
  ChildProcess gateway(cell.gateway("egm",
                                    "role: controller\nrobot: Robot1\ncontrol: {comm_timeout_s: "
                                    "3}\noutputs: {digital: {gripper: Gripper1}}\n",
                                    {"--start", "--name", "cell 7"}));
  const std::string peer_address = "127.0.0.1 port " + std::to_string(gateway_port());

  const auto alone = gateway_that(cell.client(), [](const auto&) { return true; });
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->name, "cell 7");
  EXPECT_EQ(alone->protocol, "EGM");
  EXPECT_THAT(alone->targets, ElementsAre("Robot1", "Gripper1"));
  EXPECT_EQ(alone->peer, peer_address);
  EXPECT_FALSE(alone->connected);
  EXPECT_EQ(alone->messages, 0U);

  ChildProcess peer(GatewayCell::peer("egm_client.py", {"--messages", "1000000"}));
  ASSERT_TRUE(gateway_that(cell.client(), [](const auto& g) { return g.connected && g.messages > 100; }));
  EXPECT_TRUE(has_event(cell.client(), "gateway_connected", "cell 7"));
  ChildProcess text = cell.takt({"status"});
  EXPECT_EQ(text.wait(), 0) << text.text;
  EXPECT_THAT(text.text,
              HasSubstr("cell 7: EGM for Robot1, Gripper1, connected with " + peer_address + ", "));
  ChildProcess json = cell.takt({"status", "--json"});
  EXPECT_EQ(json.wait(), 0) << json.text;
  const auto shown = nlohmann::json::parse(json.text).at("gateways").at("cell 7");
  EXPECT_EQ(shown.at("protocol"), "EGM");
  EXPECT_EQ(shown.at("connected"), true);
  EXPECT_GT(shown.at("messages"), 100);

  peer.signal(SIGKILL);
  ASSERT_TRUE(gateway_that(cell.client(), [](const auto& g) { return !g.connected; }));
  EXPECT_TRUE(has_event(cell.client(), "gateway_disconnected", "cell 7"));

  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
  EXPECT_TRUE(cell.client().wait_for(topics::status, [](const Status& s) { return s.gateways.empty(); }));
  EXPECT_TRUE(has_event(cell.client(), "gateway_ended", "cell 7"));
}

TEST(GatewayStatus, TheFactorOfThePaceStaysWhenAGatewayStartsTheCell) {
  GatewayCell cell(kBlockScenario);
  cell.client().set_pace(Pace::realtime, 0.5);
  ChildProcess gateway(cell.gateway("egm", "role: sensor\nrobot: Robot1\n", {"--start"}));
  const auto plays = cell.client().wait_for(
      topics::status, [](const Status& s) { return s.state == SimulationState::playing; });
  ASSERT_TRUE(plays) << gateway.text;
  EXPECT_EQ(plays->pace, Pace::realtime);
  EXPECT_EQ(plays->pace_factor, 0.5);
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
}

}  // namespace
}  // namespace takt::test
