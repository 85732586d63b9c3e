// Clients that freeze or die must not delay the step loop; and the program itself, from its command line on.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "server/runtime/monotonic_clock.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"

namespace takt {
namespace {

using takt::test::kBin;
using test::ChildProcess;
using test::DdsService;
using test::RawCellClient;
namespace msg = takt_msgs::msg;

/// Steps in lockstep pace, where the loop waits for every instant to be written: a delay of the writer delays
/// a step. A write that a frozen reader blocks takes the 100 ms of DDS' max_blocking_time, every time.
class DdsFrozenClient : public testing::Test {
 protected:
  static constexpr std::uint64_t kSteps = 3000;
  static constexpr std::int64_t kBlocked_ns = 90'000'000;

  RunLoopOptions options() {
    RunLoopOptions options;
    options.pace = Pace::lockstep;
    options.state = SimulationState::paused;
    options.on_instant = [this](const Simulation&) {
      const std::int64_t now = monotonic_now_ns();
      if (counting_) blocked_ += now - previous_ns_ > kBlocked_ns ? 1U : 0U;
      previous_ns_ = now;
    };
    return options;
  }
  /// Takes the steps while the subscriber is in its state; the loop stands at start and end, so that the
  /// counters belong to these steps.
  void take_steps(std::uint64_t total) {
    blocked_ = 0;
    previous_ns_ = monotonic_now_ns();
    counting_ = true;
    const auto reply = client_.request("step", {{"steps", std::to_string(kSteps)}});
    counting_ = false;
    EXPECT_EQ(reply.result, 1) << reply.message;
    EXPECT_EQ(client_.value(reply, "step"), std::to_string(total));
    // A loaded machine may delay single steps; a blocking writer would delay nearly all 3000.
    EXPECT_LT(blocked_, kSteps / 100);
  }

  std::atomic<bool> counting_{false};
  std::atomic<std::uint64_t> blocked_{0};
  std::atomic<std::int64_t> previous_ns_{0};
  DdsService service_{options()};
  RawCellClient client_;
};

TEST_F(DdsFrozenClient, AFrozenClientDelaysNoStep) {
  ChildProcess subscriber(
      {kBin + "/takt-test-subscriber", std::to_string(test::test_domain()), test::test_cell(), "Robot1"});
  // Joint states and clock are sent at every step: step until the subscriber has one of each.
  std::atomic<bool> ready{false};
  std::thread reader([&] { ready = subscriber.wait_for_output("ready"); });
  std::uint64_t total = 0;
  for (int attempt = 0; attempt < 600 && !ready; ++attempt) {
    client_.request("step", {{"steps", "1"}});
    ++total;
    (void)client_.state->wait_briefly([&](const auto&) { return ready.load(); });
  }
  if (!ready) subscriber.signal(SIGKILL);
  reader.join();
  ASSERT_TRUE(ready) << subscriber.text;

  subscriber.signal(SIGSTOP);
  take_steps(total += kSteps);
  subscriber.signal(SIGCONT);
  take_steps(total += kSteps);
  subscriber.signal(SIGSTOP);
  subscriber.signal(SIGKILL);
  take_steps(total += kSteps);
  service_.stop();
  EXPECT_EQ(service_.simulation().step_index(), total);
  RecordProperty("write_p50_us",
                 std::to_string(service_.adapter->publisher().write_time().quantile_s(0.5) * 1e6));
  RecordProperty("write_p99_us",
                 std::to_string(service_.adapter->publisher().write_time().quantile_s(0.99) * 1e6));
}

TEST(TaktServer, TheServerReportsThatItIsReadyAndEndsCleanly) {
  const auto scenario = test::write_service_scenario();
  for (const int signal : {SIGTERM, SIGINT}) {
    ChildProcess server({kBin + "/takt-server", scenario, "--cell", test::test_cell(), "--domain",
                         std::to_string(test::test_domain()), "--pace", "free", "--paused"});
    ASSERT_TRUE(server.wait_for_output("\n")) << server.text;
    EXPECT_EQ(server.text, "takt-server: cell '" + test::test_cell() +
                               "' ready: scenario service_test, pace free, domain " +
                               std::to_string(test::test_domain()) + "\n");
    RawCellClient client;
    EXPECT_EQ(client.request("step", {{"steps", "3"}}).result, 1);
    server.signal(signal);
    EXPECT_EQ(server.wait(), 0);
    EXPECT_NE(server.text.find("ended at 0.003 s"), std::string::npos) << server.text;
  }
  std::filesystem::remove(scenario);
}

TEST(TaktServer, TheServerEndsOnRequestOfAClient) {
  const auto scenario = test::write_service_scenario();
  ChildProcess server({kBin + "/takt-server", scenario, "--cell", test::test_cell(), "--domain",
                       std::to_string(test::test_domain()), "--paused"});
  ASSERT_TRUE(server.wait_for_output("ready"));
  RawCellClient client;
  EXPECT_EQ(client.request("set_state", {{"state", "3"}}).result, 1);
  EXPECT_EQ(server.wait(), 0);
  std::filesystem::remove(scenario);
}

TEST(TaktServer, TheServerEndsAtTheEndOfTheScenarioOnRequest) {
  const auto scenario = test::write_service_scenario();
  ChildProcess server({kBin + "/takt-server", scenario, "--cell", test::test_cell(), "--domain",
                       std::to_string(test::test_domain()), "--pace", "free", "--exit-at-end", "--set",
                       "duration_s=0.123", "--profiles", std::string(TAKT_CONFIG_DIR) + "/dds/profiles.xml"});
  EXPECT_EQ(server.wait(), 0);
  EXPECT_NE(server.text.find("ended at 0.123 s"), std::string::npos) << server.text;
  std::filesystem::remove(scenario);
}

TEST(TaktServer, InvalidInputIsReportedWithExitCodeTwo) {
  const auto scenario = test::write_service_scenario();
  const auto broken = scenario.string() + ".broken.xml";
  std::ofstream(broken)
      << "<profiles><participant profile_name=\"x\"";  // Fast DDS 3 accepts all well-formed text
  struct Case {
    std::vector<std::string> arguments;
    std::string words;
  };
  const std::vector<Case> cases{
      {{"--set", "solver.step_s=0.002"}, "--set concerns a scenario"},
      {{"--lod", "2"}, "--lod concerns a scenario"},
      {{"/no/such/file.yaml"}, "/no/such/file.yaml"},
      {{scenario, "--pace", "fast"}, "fast not in {realtime,free,lockstep}"},
      {{scenario, "--factor", "0"}, "--factor"},
      {{scenario, "--domain", "233"}, "--domain"},
      {{scenario, "--cell", "a/b"}, "--cell 'a/b' cannot be part of a topic name"},
      {{scenario, "--set", "solver.stepp=1"}, "stepp"},
      {{scenario, "--profiles", "/no/such/profiles.xml"}, "/no/such/profiles.xml"},
      {{scenario, "--profiles", broken}, "The DDS profiles in '" + broken + "' cannot be read"},
      {{scenario, "--profiles", std::string(TAKT_CONFIG_DIR) + "/dds/profiles.xml", "--profile", "nobody"},
       "have no participant profile 'nobody'"},
      {{scenario, "--no-such-option"}, "--no-such-option"},
  };
  for (const Case& bad : cases) {
    std::vector<std::string> command{kBin + "/takt-server"};
    command.insert(command.end(), bad.arguments.begin(), bad.arguments.end());
    ChildProcess server(command);
    EXPECT_EQ(server.wait(), 2) << server.text;
    EXPECT_NE(server.text.find(bad.words), std::string::npos) << server.text;
  }
  std::filesystem::remove(scenario);
  std::filesystem::remove(broken);
}

}  // namespace
}  // namespace takt
