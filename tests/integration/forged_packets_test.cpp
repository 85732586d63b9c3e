// Packets sent by a stranger in the name of the server or of a client: both are served on.
#include <gtest/gtest.h>

#include "client_lib/client.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/forged_kinds.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::RtpsError;
using takt::State;
using takt::test::bytes_of;
using takt::test::ChildProcess;
using takt::test::client_options;
using takt::test::dropped_for;
using takt::test::entity_of;
using takt::test::ForeignSender;
using takt::test::ForgedKind;
using takt::test::Forgery;
using takt::test::HostedService;
using takt::test::invented_prefix;
using takt::test::kBin;
using takt::test::kFarNumber;
using takt::test::kGenerous;
using takt::test::PacketBytes;
using takt::test::prefix_of;
using takt::test::test_cell;
using takt::test::test_domain;
using takt::test::Victim;
using takt::test::WriterSpy;

class ForgedPackets : public testing::TestWithParam<ForgedKind> {
 protected:
  static void SetUpTestSuite() { takt::deliver_through_transports(); }

  /// Sends the packet until the client has dropped it as not the server's own.
  static void forge(Client& client, const ForeignSender& stranger, const PacketBytes& packet,
                    const PacketBytes& harmless) {
    const auto dropped = [&] { return dropped_for("source", client.dropped_packets()); };
    const std::uint64_t before = dropped();
    stranger.send(packet);
    stranger.send(harmless);  // announcements are dropped without being counted
    const auto noted = client.wait_for(
        takt::topics::state, [&](const State&) { return dropped() > before; }, kGenerous);
    ASSERT_TRUE(noted.has_value()) << client.dropped_packets();
  }
  /// Sends harmless packets in the server's name until the client knows that they are not the server's.
  /// From a socket of its own each time: one that goes on is believed after a while.
  static void wait_until_the_server_is_known(const Client& client, const Victim& victim) {
    const auto known = client.wait_for(
        takt::topics::state,
        [&](const State&) {
          if (dropped_for("source", client.dropped_packets()) > 0) return true;
          ForeignSender(test_domain()).send(victim.harmless());
          return false;
        },
        kGenerous);
    ASSERT_TRUE(known.has_value());
  }
};

INSTANTIATE_TEST_SUITE_P(Kinds, ForgedPackets, testing::ValuesIn(takt::test::forged_kinds()),
                         [](const auto& kind) { return kind.param.name; });

TEST_P(ForgedPackets, AClientIsServedOn) {
  HostedService service(true, [] {
    auto options = HostedService::paused();
    options.loop.pace = takt::Pace::realtime;
    return options;
  }());
  Client client(client_options());
  client.play();
  WriterSpy spy(test_domain());
  const Victim victim(spy, test_cell());
  const ForeignSender stranger(test_domain());
  wait_until_the_server_is_known(client, victim);
  ASSERT_FALSE(HasFatalFailure());
  const State before = client.state();
  forge(client, stranger, GetParam().make(victim, before), victim.harmless());
  ASSERT_FALSE(HasFatalFailure());

  const auto later = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.step > before.step + 100; }, kGenerous);
  ASSERT_TRUE(later.has_value());
  EXPECT_EQ(later->epoch, before.epoch);
  EXPECT_EQ(later->scenario_generation, before.scenario_generation);
  EXPECT_LT(later->time, 1e6);
  EXPECT_EQ(later->cell, before.cell) << "the same description";
  EXPECT_TRUE(client.connected());
  // Requests, replies and events pass, none was missed.
  client.pause();
  client.reset();
  const auto event = client.wait_for(
      takt::topics::event, [](const takt::Event& e) { return e.code == "reset"; }, kGenerous);
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(event->missed_before, 0U);
  EXPECT_EQ(client.state().epoch, before.epoch + 1) << "a genuine reset is recognised at once";
}

TEST_F(ForgedPackets, ACommandInAClientsNameWithAStampFarAheadIsDropped) {
  HostedService service;
  Client client(client_options());
  WriterSpy spy(test_domain());
  const std::string robot = client.cell()->robots.front().name;
  const std::size_t joints = client.cell()->robots.front().joints.size();
  const auto positions = client.state().robots.front().position;
  client.send_joint_command(robot, positions);
  const auto writer = spy.writer_of(test_cell() + "/" + robot + "/joint_commands");
  const Forgery forgery(prefix_of(writer));
  sensor_msgs::msg::JointState command;
  command.header.stamp.sec = 2'000'000'000;
  for (const auto& joint : client.cell()->robots.front().joints) command.name.push_back(joint.name);
  command.position.assign(joints, 3.0);
  const ForeignSender stranger(test_domain());
  const auto* guard = service.adapter->guard();
  const auto count = [&] { return guard->counted(RtpsError::source); };
  for (std::uint64_t before = 0; before == 0; before = count()) {
    ForeignSender(test_domain()).send(forgery.heartbeat(0x00ff0103, 1, 1));
    client.get_state();
  }
  const std::uint64_t before = count();
  stranger.send(forgery.sample(entity_of(writer), kFarNumber, bytes_of(command)));
  while (count() == before) client.get_state();
  client.send_joint_command(robot, positions, {}, client.state().time);
  client.step(20);
  const State now = client.state();
  for (std::size_t i = 0; i < joints; ++i) EXPECT_NEAR(now.robots.front().position[i], positions[i], 1e-3);
}

/// 58 kB took all places for participants, for an hour.
TEST_F(ForgedPackets, InventedParticipantsDoNotKeepANewClientOut) {
  HostedService service;
  const ForeignSender stranger(test_domain());
  Client client(client_options());
  const auto* guard = service.adapter->guard();
  for (std::uint32_t i = 0; i < 300; ++i) stranger.announce(Forgery(invented_prefix(i)).announcement(3600));
  // All of them have passed or were refused when one behind them was; a full socket loses it.
  while (guard->counted(RtpsError::lease) == 0) {
    stranger.announce(Forgery(invented_prefix(300)).announcement(3601));
    client.get_state();
  }
  EXPECT_GT(guard->counted(RtpsError::crowded), 0U) << guard->summary();
  ChildProcess status({kBin + "/takt", "--cell", test_cell(), "--domain", std::to_string(test_domain()),
                       "--timeout", "60", "status"});
  EXPECT_EQ(status.wait(), 0) << status.text;
  EXPECT_NE(status.text.find(test_cell()), std::string::npos) << status.text;
  EXPECT_TRUE(client.connected()) << "one that was there before stays";
}

}  // namespace
