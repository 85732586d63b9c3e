// The source between the page of takt view and a running cell.
#include "client_lib/view/live_source.h"

#include <gtest/gtest.h>

#include <future>
#include <memory>

#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::test::ChildProcess;

std::unique_ptr<ChildProcess> paused_server() {
  return std::make_unique<ChildProcess>(std::vector<std::string>{
      std::string(TAKT_BIN_DIR) + "/takt-server",
      std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", "--cell", takt::test::test_cell(),
      "--domain", std::to_string(takt::test::test_domain()), "--paused"});
}

takt::Arguments steps(std::uint64_t count) {
  return takt::arguments_of(takt::requests::Step{.steps = count});
}

TEST(LiveSource, ARequestReachesARestartingServer) {
  auto server = paused_server();
  takt::ClientOptions options;
  options.cell = takt::test::test_cell();
  options.domain = static_cast<int>(takt::test::test_domain());
  options.timeout = takt::test::kGenerous;
  takt::view::Stream stream;
  takt::view::LiveSource source(options, stream);
  ASSERT_EQ(source.request("step", steps(3)).result, takt::ControlResult::ok);

  for (int restart = 0; restart < 3; ++restart) {
    server->signal(SIGTERM);
    ASSERT_EQ(server->wait(), 0);
    auto answer = std::async(std::launch::async, [&] { return source.request("step", steps(2)); });
    server = paused_server();
    takt::view::Answer got = answer.get();
    // The server may answer ahead of its scenario, and then reports that.
    while (got.message.find("being loaded; ask again") != std::string::npos)
      got = source.request("step", steps(2));
    EXPECT_EQ(got.result, takt::ControlResult::ok) << got.message;
    takt::requests::StepResponse response;
    EXPECT_FALSE(takt::read_arguments("step", got.values, response));
    EXPECT_EQ(response.step, 2U);  // once, and by the new server
  }
}

TEST(LiveSource, ARequestToAMissingCellIsRefused) {
  auto server = paused_server();
  takt::ClientOptions options;
  options.cell = takt::test::test_cell();
  options.domain = static_cast<int>(takt::test::test_domain());
  takt::view::Stream stream;
  takt::view::LiveSource source(options, stream);
  ASSERT_EQ(source.request("get_state", {}).result, takt::ControlResult::ok);
  server->signal(SIGTERM);
  ASSERT_EQ(server->wait(), 0);
  const takt::view::Answer answer = source.request("step", {});
  EXPECT_EQ(answer.result, takt::ControlResult::failed);
  EXPECT_NE(answer.message.find("gone away"), std::string::npos) << answer.message;
}

}  // namespace
