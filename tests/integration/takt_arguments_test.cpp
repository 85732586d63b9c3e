// Reports of takt and the other programs on wrong words and numbers, and takt watch and step with a server
// that never reaches their goal.
#include <gtest/gtest.h>

#include <optional>

#include "client_lib/client.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::test::ChildProcess;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::kBin;

std::vector<std::string> of_this_cell(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), kBin + "/takt");
  arguments.insert(arguments.end(), {"--cell", takt::test::test_cell(), "--domain",
                                     std::to_string(takt::test::test_domain())});
  return arguments;
}

TEST(TaktArguments, InvalidArgumentsAreReportedWithTheAllowedOnes) {
  struct WrongArguments {
    std::vector<std::string> command;
    std::string words;
  };
  const std::string a_file = std::string(TAKT_CONFIG_DIR) + "/programs/block_assembly.lua";
  for (const WrongArguments& wrong : std::vector<WrongArguments>{
           {{"takt", "status", "--timeout", "nan"}, "--timeout: found 'nan'; allowed: a finite number > 0"},
           {{"takt", "status", "--timeout", "0"}, "--timeout: found '0'; allowed: a finite number > 0"},
           {{"takt", "status", "--domain", "233"}, "found '233'; allowed: a whole number from 0 to 232"},
           {{"takt", "watch", "--until", "nan"}, "--until: found 'nan'; allowed: a finite number >= 0"},
           {{"takt", "power", "--until", "inf"}, "--until: found 'inf'; allowed: a finite number >= 0"},
           {{"takt", "record", "-", "--period", "nan"},
            "--period: found 'nan'; allowed: a finite number > 0"},
           {{"takt", "record", "-", "--duration", "-1"},
            "--duration: found '-1'; allowed: a finite number >= 0"},
           {{"takt", "record", "-", "--duration", "nan"},
            "--duration: found 'nan'; allowed: a finite number >= 0"},
           {{"takt", "events", "--count", "-1"}, "--count: found '-1'; allowed: a whole number >= 1"},
           {{"takt", "step", "0"}, "N: found '0'; allowed: a whole number >= 1"},
           {{"takt", "step", "1.5"}, "N: found '1.5'; allowed: a whole number >= 1"},
           {{"takt", "plot", a_file, "x", "--size", "1200"}, "found '1200'; allowed: WIDTH,HEIGHT"},
           {{"takt", "replay", a_file, "--rate", "nan"}, "--rate: found 'nan'; allowed: a finite number > 0"},
           {{"takt", "view", "--port", "65536"}, "found '65536'; allowed: a whole number from 0 to 65535"},
           {{"takt", "move", "P", "--at", "0", "nan", "0"}, "--at: found 'nan'; allowed: a finite number"},
           {{"takt", "pace", "x"}, "x not in {realtime,free,lockstep}"},
           {{"takt", "nosuch"}, "There is no command 'nosuch'. Commands: list, status, "},
           {{"takt", "statsu"}, "There is no command 'statsu'. Did you mean 'status'?"},
           {{"takt", "--json", "nosuch"}, R"({"error":"There is no command 'nosuch'. Commands: )"},
           {{"takt-controller", a_file, "--until", "nan"}, "found 'nan'; allowed: a finite number >= 0"},
           {{"takt-controller", a_file, "--pace", "x"}, "x not in {realtime,free,lockstep}"},
           {{"takt-server", "--snapshot-every", "nan"}, "found 'nan'; allowed: a number from 0.05 to 86400"},
           {{"takt-server", "--factor", "nan"}, "found 'nan'; allowed: a number from 0.001 to 1000"},
           {{"takt-run", "run", "x.yaml", "--duration", "nan"}, "found 'nan'; allowed: a finite number > 0"},
           {{"takt-run", "run", "x.yaml", "--factor", "-1"}, "found '-1'; allowed: a finite number > 0"},
           {{"takt-run", "run", "x.yaml", "--lod", "7"}, "found '7'; allowed: a whole number from 1 to 3"},
       }) {
    std::vector<std::string> command = wrong.command;
    command[0] = kBin + "/" + command[0];
    ChildProcess program(command);
    EXPECT_EQ(program.wait(), 2) << wrong.words << ", but: " << program.text;
    expect_words(program.text, {wrong.words.c_str()});
  }
}

TEST(TaktArguments, APaceIsReadInUpperAndLowerCase) {
  HostedService service;
  ChildProcess program(of_this_cell({"pace", "FREE"}));
  EXPECT_EQ(program.wait(), 0) << program.text;
}

TEST(TaktWatch, WatchReportsAnEmptyCellAndWaitsForAScenario) {
  HostedService service;
  Client client(client_options());
  // An answer would be waited for this long, s; the next scenario is waited for however long it takes.
  constexpr int kTimeout_s = 4, kStatusesPerSecond = 10, kAttempts = 20;
  std::optional<ChildProcess> started;
  for (int i = 0; i < kAttempts; ++i) {  // the first answer may take longer on a loaded machine
    started.emplace(of_this_cell({"watch", "--timeout", std::to_string(kTimeout_s)}));
    if (started->wait_for_output("P:")) break;
  }
  ChildProcess& watch = *started;
  client.unload_scenario();
  ASSERT_TRUE(watch.wait_for_output("no scenario\n")) << watch.text;
  const std::uint64_t first = client.status().sample_number;
  ASSERT_TRUE(client.wait_for(
      takt::topics::status,
      [&](const auto& s) { return s.sample_number > first + kStatusesPerSecond * (kTimeout_s + 1); },
      takt::test::kGenerous));
  client.load_scenario(service.one_arm().string());
  ASSERT_TRUE(watch.wait_for_output("Q:")) << watch.text;
  watch.signal(SIGTERM);
  watch.wait();
  EXPECT_EQ(watch.text.find("no scenario"), watch.text.rfind("no scenario")) << watch.text;
}

TEST(TaktStep, AStepBeyondTheTimeoutContinuesAndIsReported) {
  takt::HostOptions options = HostedService::paused();
  options.loop.pace = takt::Pace::realtime;
  HostedService service(true, options);
  Client client(client_options());
  const std::string unanswered = "has not answered 'step'";
  constexpr int kAttempts = 20;
  std::optional<ChildProcess> step;
  int code = 0;
  for (int i = 0; i < kAttempts; ++i) {  // to reach the server may take longer on a loaded machine
    step.emplace(of_this_cell({"step", "1000000000", "--timeout", "2"}));
    code = step->wait();
    if (step->text.find(unanswered) != std::string::npos) break;
  }
  EXPECT_EQ(code, 1) << step->text;
  expect_words(step->text, {unanswered.c_str(), "goes on with it; 'takt pause' ends it"});
  ChildProcess pause(of_this_cell({"pause"}));
  EXPECT_EQ(pause.wait(), 0) << pause.text;
  EXPECT_EQ(client.get_state(), takt::SimulationState::paused);
  const std::uint64_t at = client.state().step;
  client.step(3);
  EXPECT_EQ(client.state().step, at + 3);
}

}  // namespace
