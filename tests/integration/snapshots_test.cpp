// Snapshots over DDS, and a killed server that resumes from its newest one.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "client_lib/client.h"
#include "tests/support/child_process.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::Event;
using takt::Reply;
using takt::Seconds;
using takt::SimulationState;
using takt::State;
using takt::Status;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::kGenerous;
using takt::test::refusal;

takt::HostOptions with_snapshots(const takt::test::TemporaryDirectory& directory, double every_s = 0.0) {
  takt::HostOptions options = HostedService::paused();
  options.snapshots = directory.path();
  options.loop.save_every_s = every_s;
  return options;
}

std::optional<State> state_at(const Client& client, std::uint32_t epoch, std::uint64_t step) {
  return client.wait_for(
      takt::topics::state, [&](const State& s) { return s.epoch == epoch && s.step == step; }, kGenerous);
}

TEST(Snapshots, ARestoredStateContinuesWithTheSameBits) {
  const takt::test::TemporaryDirectory directory;
  HostedService service(true, with_snapshots(directory));
  Client client(client_options());
  std::vector<double> target = client.state().robot("Robot1").position;
  target[5] += 0.01;
  client.send_joint_command("Robot1", target);
  client.step(40);
  const Reply saved = client.request("save_snapshot", {{"name", "before"}});
  EXPECT_EQ(saved.text("step"), "40");
  EXPECT_TRUE(std::filesystem::exists(directory / takt::test::test_cell() / "before.snapshot"));
  client.step(60);
  const auto straight = state_at(client, 0, 100);
  ASSERT_TRUE(straight.has_value());

  const Reply restored = client.request("restore_snapshot", {{"name", "before"}});
  EXPECT_EQ(restored.text("step"), "40");
  const auto epoch = static_cast<std::uint32_t>(std::stoul(restored.text("epoch")));
  EXPECT_GT(epoch, 0U);
  ASSERT_TRUE(state_at(client, epoch, 40).has_value());
  EXPECT_EQ(client.get_state(), SimulationState::paused);
  client.step(60);
  const auto again = state_at(client, epoch, 100);
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->state_hash, straight->state_hash);
}

TEST(Snapshots, SnapshotsAreRefusedForNamePlaceAndScenario) {
  const takt::test::TemporaryDirectory directory;
  HostedService service(true, with_snapshots(directory));
  Client client(client_options());
  for (const char* name : {"../outside", "a/b", ".hidden", "/tmp/x", "..", "a b"}) {
    for (const char* request : {"save_snapshot", "restore_snapshot"}) {
      const ClientError error = refusal(client, request, {{"name", name}});
      EXPECT_EQ(error.result(), takt::ControlResult::failed) << name;
      expect_words(error.what(), {"not a path"});
    }
  }
  EXPECT_EQ(refusal(client, "restore_snapshot", {{"name", "nobody"}}).result(),
            takt::ControlResult::not_found);
  EXPECT_EQ(refusal(client, "restore_snapshot").result(), takt::ControlResult::not_found);
  client.request("save_snapshot", {{"name", "two"}});
  client.request("load_scenario", {{"uri", service.one_arm().string()}});
  const ClientError other = refusal(client, "restore_snapshot", {{"name", "two"}});
  EXPECT_EQ(other.result(), takt::ControlResult::failed);
  expect_words(other.what(), {"two.snapshot", "service_test"});
  client.request("unload_scenario");
  EXPECT_EQ(refusal(client, "save_snapshot", {{"name", "none"}}).result(),
            takt::ControlResult::incorrect_state);
}

TEST(Snapshots, SnapshotsWithoutADirectoryAreRefused) {
  HostedService service;
  Client client(client_options());
  const ClientError error = refusal(client, "save_snapshot", {{"name", "a"}});
  EXPECT_EQ(error.result(), takt::ControlResult::unsupported);
  expect_words(error.what(), {"--snapshots"});
}

TEST(Snapshots, TheNewestThreePeriodicSnapshotsAreKept) {
  const takt::test::TemporaryDirectory directory;
  const auto periodic = directory / takt::test::test_cell() / "periodic";
  {
    HostedService service(true, with_snapshots(directory, 0.001));
    Client client(client_options());
    const auto written = [&](std::uint64_t number) {
      return std::filesystem::exists(periodic / (std::to_string(number) + ".snapshot"));
    };
    std::uint64_t newest = 0;
    for (std::uint64_t step = 0; step < 100000 && newest < 5; ++step) {
      client.step(1);
      while (written(newest + 1)) ++newest;
    }
    ASSERT_GE(newest, 5U);
    const Reply back = client.request("restore_snapshot");
    EXPECT_GT(std::stoul(back.text("step")), 0U);
  }
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(periodic))
    count += entry.path().extension() == ".snapshot" ? 1U : 0U;
  EXPECT_EQ(count, 3U);
}

TEST(Snapshots, APartIsPutElsewhereAttachedAndDetached) {
  HostedService service;
  Client client(client_options());
  client.request("set_entity_state", {{"entity", "C"}, {"position", "0.3 -0.2 1.5"}});
  const auto put = client.wait_for(
      takt::topics::state, [](const State& s) { return std::abs(s.component("C").position.z - 1.5) < 1e-12; },
      kGenerous);
  ASSERT_TRUE(put.has_value());
  // Attached to the table it stays in the air; detached it falls.
  client.request("attach", {{"part", "C"}, {"to", "Table1"}});
  client.step(100);
  auto state = state_at(client, 0, 100);
  ASSERT_TRUE(state.has_value());
  EXPECT_NEAR(state->component("C").position.z, 1.5, 2e-4);
  EXPECT_EQ(state->partner_of("C"), "Table1");
  client.request("detach", {{"part", "C"}});
  client.step(100);
  state = state_at(client, 0, 200);
  ASSERT_TRUE(state.has_value());
  EXPECT_LT(state->component("C").position.z, 1.5 - 0.5 * 9.8 * 0.09 * 0.09);
  for (const char* code : {"entity_state_set", "attached", "detached"}) {
    const auto reported = client.wait_for(
        takt::topics::event, [&](const Event& e) { return e.code == code && e.subject == "C"; }, kGenerous);
    EXPECT_TRUE(reported.has_value()) << code;
  }
  EXPECT_EQ(refusal(client, "attach", {{"part", "Table1"}, {"to", "C"}}).result(),
            takt::ControlResult::failed);
  EXPECT_EQ(refusal(client, "attach", {{"part", "C"}, {"to", "nobody"}}).result(),
            takt::ControlResult::not_found);
  client.play();
  EXPECT_EQ(refusal(client, "set_entity_state", {{"entity", "C"}, {"position", "0 0 2"}}).result(),
            takt::ControlResult::incorrect_state);
}

/// The program under a supervisor.
class Supervised : public testing::Test {
 protected:
  explicit Supervised(std::vector<std::string> more = {}) : server_(command(std::move(more))) {}

  std::vector<std::string> command(std::vector<std::string> more) {
    std::vector<std::string> all{std::string(TAKT_BIN_DIR) + "/takt-server",
                                 service_.two_robots().string(),
                                 "--cell",
                                 cell_,
                                 "--domain",
                                 std::to_string(takt::test::test_domain()),
                                 "--supervised",
                                 "--snapshots",
                                 directory_.path().string(),
                                 "--snapshot-every",
                                 "0.05"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  takt::ClientOptions options() const {
    takt::ClientOptions options = client_options();
    options.cell = cell_;
    return options;
  }
  /// The process of the server's next run, when it is ready.
  pid_t wait_for_child() {
    const std::string words = "the server is process ";
    EXPECT_TRUE(server_.wait_for_output(words)) << server_.text;
    const auto at = server_.text.find(words);
    server_.text.erase(0, at + words.size());
    EXPECT_TRUE(server_.wait_for_output("ready")) << server_.text;
    return static_cast<pid_t>(std::stol(server_.text));
  }

  /// The number of the newest periodic snapshot.
  int newest_snapshot() const {
    int newest = 0;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path() / cell_ / "periodic"))
      if (entry.path().extension() == ".snapshot")
        newest = std::max(newest, std::stoi(entry.path().stem().string()));
    return newest;
  }
  static constexpr int kSurelyLater = 3;  ///< numbers further: one may be being written, one may wait

  takt::test::TemporaryDirectory directory_;
  const std::string cell_ = takt::test::test_cell() + "_supervised";
  HostedService service_{false};  // for its scenario files
  takt::test::ChildProcess server_;
};

TEST_F(Supervised, TheServerContinuesFromTheNewestSnapshotAndReportsIt) {
  const pid_t first = wait_for_child();
  Client client(options());
  const auto saved = [&] {
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path() / cell_ / "periodic"))
      if (entry.path().extension() == ".snapshot" && entry.path().filename() != "1.snapshot") return true;
    return false;
  };
  // The second periodic snapshot is of the running cell; states come meanwhile.
  ASSERT_TRUE(client.wait_for(
      takt::topics::state, [&](const State& s) { return s.step > 100 && saved(); }, kGenerous));
  const State before = client.state();
  ::kill(first, SIGKILL);
  const pid_t second = wait_for_child();
  EXPECT_NE(second, first);
  ASSERT_TRUE(client.wait_for_connection(kGenerous));
  const auto reported = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "restarted"; }, kGenerous);
  ASSERT_TRUE(reported.has_value());
  expect_words(reported->message, {"signal 9", "goes on at", "playing"});
  const auto after = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.epoch > before.epoch; }, kGenerous);
  ASSERT_TRUE(after.has_value());
  EXPECT_GT(after->step, 0U);
  EXPECT_EQ(client.get_state(), SimulationState::playing);
  client.set_state(SimulationState::quitting);
  EXPECT_EQ(server_.wait(), 0) << server_.text;
}

/// The client survives the crash without an error: the new server applies no command that was sent to the old
/// one or during its absence, and its states continue in a new epoch, at a reported time.
TEST_F(Supervised, CommandsFromBeforeTheCrashAreNotApplied) {
  const pid_t first = wait_for_child();
  Client client(options());
  const auto applied = [](const State& s) { return s.applied.front().count; };
  const double home = client.state().robot("Robot1").position[5];
  const auto command = [&](double offset) {
    std::vector<double> target = client.state().robot("Robot1").position;
    target[5] = home + offset;
    client.send_joint_command("Robot1", target);
  };
  for (int i = 1; i <= 20; ++i) {
    const std::uint64_t before = applied(client.state());
    command(0.001 * i);
    ASSERT_TRUE(client.wait_for(
        takt::topics::state, [&](const State& s) { return applied(s) > before; }, kGenerous));
  }
  // Several periodic snapshots later.
  const std::uint64_t last = client.state().step;
  const int saved = newest_snapshot() + kSurelyLater;
  ASSERT_TRUE(client.wait_for(
      takt::topics::state, [&](const State& s) { return s.step > last + 500 && newest_snapshot() >= saved; },
      kGenerous));
  const State before = client.state();
  ::kill(first, SIGKILL);
  for (int i = 0; i < 50; ++i) {
    try {
      command(0.5);
    } catch (const ClientError&) {  // it may have detected the crash already
    }
  }
  ASSERT_NE(wait_for_child(), first);
  const auto reported = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "restarted"; }, kGenerous);
  ASSERT_TRUE(reported.has_value());
  expect_words(reported->message, {"goes on at", " s (step "});
  const auto after = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.epoch > before.epoch; }, kGenerous);
  ASSERT_TRUE(after.has_value());
  EXPECT_EQ(applied(*after), applied(before));
  std::uint64_t older = 0;
  const auto later = client.wait_for(
      takt::topics::state,
      [&](const State& s) {
        older += s.epoch < after->epoch ? 1U : 0U;
        return s.step > after->step + 300;
      },
      kGenerous);
  ASSERT_TRUE(later.has_value());
  EXPECT_EQ(older, 0U) << "nothing of the old life is shown any more";
  EXPECT_EQ(applied(*later), applied(before));
  EXPECT_NEAR(later->robot("Robot1").position[5], home + 0.02, 0.005);
  command(0.021);
  EXPECT_TRUE(client.wait_for(
      takt::topics::state, [&](const State& s) { return applied(s) > applied(before); }, kGenerous));
}

/// Robot programs begin with the cell. A resumed cell has no program until a reset by the user.
TEST_F(Supervised, AControllerRestartsOnlyAfterAResetOfTheResumedCell) {
  const pid_t first = wait_for_child();
  directory_.write(
      "program.lua",
      "period_s = 0.008\nroutine('Robot1', function(r)\n  while true do r:wait(0.1) end\nend)\n");
  takt::test::ChildProcess controller({std::string(TAKT_BIN_DIR) + "/takt-controller",
                                       (directory_ / "program.lua").string(), "--cell", cell_, "--domain",
                                       std::to_string(takt::test::test_domain()), "--start"});
  Client client(options());
  const auto applied = [](const State& s) { return s.applied.front().count; };
  // Later than the limit of a fresh start (2 s), and with snapshots of that time.
  ASSERT_TRUE(client.wait_for(
      takt::topics::state, [](const State& s) { return s.time > 2.5; }, kGenerous));
  const int saved = newest_snapshot() + kSurelyLater;
  const auto before = client.wait_for(
      takt::topics::state, [&](const State& s) { return applied(s) > 100 && newest_snapshot() >= saved; },
      kGenerous);
  ASSERT_TRUE(before.has_value());
  ::kill(first, SIGKILL);
  ASSERT_NE(wait_for_child(), first);
  ASSERT_TRUE(controller.wait_for_output("begins when it is reset")) << controller.text;
  controller.text.clear();
  const auto after = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.epoch > before->epoch; }, kGenerous);
  ASSERT_TRUE(after.has_value());
  const auto later = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.step > after->step + 300; }, kGenerous);
  ASSERT_TRUE(later.has_value());
  EXPECT_EQ(applied(*later), applied(*after));
  client.reset();
  client.play();
  ASSERT_TRUE(controller.wait_for_output("starts again.")) << controller.text;
  const auto again = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.epoch > later->epoch && applied(s) > 10; },
      kGenerous);
  EXPECT_TRUE(again.has_value());
}

TEST_F(Supervised, TheServerKeepsTheLoadedScenarioAndSpawnedParts) {
  const pid_t first = wait_for_child();
  {
    Client client(options());
    client.request("load_scenario", {{"uri", service_.one_arm().string()}});
    const Reply reply =
        client.request("spawn_entity", {{"name", "R"}, {"copy_of", "Q"}, {"position", "0 0 3"}});
    ASSERT_TRUE(client
                    .wait_for(
                        takt::topics::state,
                        [&](const State& s) {
                          return std::to_string(s.cell->scenario_generation) ==
                                 reply.text("scenario_generation");
                        },
                        kGenerous)
                    .has_value());
    client.step(20);
    const auto session = directory_.path() / cell_ / "periodic" / "session.json";
    const auto recorded = [&] {
      std::stringstream text;
      text << std::ifstream(session).rdbuf();
      return text.str().find("\"state\": 2") != std::string::npos &&
             text.str().find("copy_of") != std::string::npos;
    };
    ASSERT_TRUE(client
                    .wait_for(
                        takt::topics::status, [&](const Status&) { return recorded(); }, kGenerous)
                    .has_value());
  }
  ::kill(first, SIGKILL);
  wait_for_child();
  Client client(options());
  EXPECT_EQ(client.cell()->scenario, "one_arm");
  EXPECT_GE(client.cell()->find_component("R"), 0);
  EXPECT_EQ(client.get_state(), SimulationState::paused);
}

TEST_F(Supervised, TheSupervisorGivesUpAfterRepeatedCrashes) {
  for (int crash = 1; crash <= 5; ++crash) {
    const pid_t child = wait_for_child();
    ::kill(child, crash % 2 == 0 ? SIGABRT : SIGKILL);
  }
  EXPECT_EQ(server_.wait(), 1);
  expect_words(server_.text, {"5th time", "not started again"});
}

TEST_F(Supervised, TheServerEndsWithItsSupervisor) {
  wait_for_child();
  server_.signal(SIGTERM);
  EXPECT_EQ(server_.wait(), 0) << server_.text;
  expect_words(server_.text, {"ended at"});
}

}  // namespace
