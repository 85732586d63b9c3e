// The program takt-server: its arguments, and its end.
#include <gtest/gtest.h>
#include <signal.h>

#include <string>

#include "client_lib/client.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/hosting_client.h"
#include "tests/support/temporary_directory.h"

namespace {

using takt::Client;
using takt::test::ChildProcess;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::kBin;
using takt::test::kBlockScenario;
using takt::test::refusal;
using takt::test::TemporaryDirectory;

const std::string kServer = kBin + "/takt-server";

std::string test_domain_text() {
  return std::to_string(takt::test::test_domain());
}

TEST(ServerProgram, TheProgramEndsCleanlyOnEachSignal) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    ChildProcess server({kServer, "--cell", takt::test::test_cell(), "--domain", test_domain_text()});
    ASSERT_TRUE(server.wait_for_output("ready")) << server.text;
    server.signal(number);
    EXPECT_EQ(server.wait(), 0) << server.text;
    expect_words(server.text.c_str(), {"ended"});
  }
}

/// The end of the process does not wait for an import. The child is stopped shortly after its start.
TEST(ServerProgram, TheProgramEndsWhileItsScenarioIsRead) {
  for (const int number : {SIGTERM, SIGHUP}) {
    ChildProcess server({kServer, kBlockScenario, "--supervised", "--cell", takt::test::test_cell(),
                         "--domain", test_domain_text()});
    ASSERT_TRUE(server.wait_for_output("the server is process")) << server.text;
    server.signal(number);
    EXPECT_EQ(server.wait(), 0) << server.text;
    expect_words(server.text.c_str(), {"ended"});
    EXPECT_EQ(server.text.find("started again"), std::string::npos) << server.text;
  }
}

TEST(ServerProgram, TheCellComesFromTheEnvironment) {
  ChildProcess server({"/usr/bin/env", "TAKT_CELL=of_environment", kServer, "--domain", test_domain_text()});
  ASSERT_TRUE(server.wait_for_output("ready")) << server.text;
  expect_words(server.text.c_str(), {"cell 'of_environment'"});
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
}

TEST(ServerProgram, ImpossibleOptionsAreRefused) {
  const TemporaryDirectory directory;
  directory.write("file", "");
  ChildProcess server({kServer, "--supervised", "--snapshots", (directory / "file").string(), "--domain",
                       test_domain_text()});
  EXPECT_EQ(server.wait(), 2) << server.text;
  expect_words(server.text.c_str(), {"cannot be made"});
  EXPECT_EQ(server.text.find("started again"), std::string::npos) << server.text;
}

TEST(ServerProgram, TheLogOfTheProgramIsNotEndedByRequest) {
  const TemporaryDirectory directory;
  const std::string log = (directory / "own.taktlog").string();
  ChildProcess server({kServer, kBlockScenario, "--paused", "--log", log, "--recordings",
                       (directory / "recordings").string(), "--cell", takt::test::test_cell(), "--domain",
                       test_domain_text()});
  ASSERT_TRUE(server.wait_for_output("ready")) << server.text;
  Client client(client_options());
  const auto refused = refusal(client, "stop_recording", {});
  EXPECT_EQ(refused.result(), takt::ControlResult::incorrect_state);
  expect_words(refused.what(), {"own.taktlog"});
  expect_words(refusal(client, "start_recording", {{"name", "more"}}).what(), {"log of the server"});
  client.step(10);
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0) << server.text;
  ChildProcess replay({kBin + "/takt-run", "replay", log});
  EXPECT_EQ(replay.wait(), 0) << replay.text;
}

}  // namespace
