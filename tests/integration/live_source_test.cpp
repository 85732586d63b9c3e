// The source between the page of takt view and a running cell.
#include "client_lib/view/live_source.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <memory>
#include <optional>
#include <span>

#include "idl/common/cdr.h"
#include "takt_msgs.h"
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
  ASSERT_TRUE(server->wait_for_output("ready")) << server->text;
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
  ASSERT_TRUE(server->wait_for_output("ready")) << server->text;
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

/// The newest sample of a topic for which `accepts` holds.
template <typename Type, typename Accepts>
Type sample_of(const takt::Client& cell, takt::view::Stream& stream, const std::string& topic,
               Accepts accepts) {
  for (std::uint64_t seen = 0;;) {
    for (const takt::view::Channel& channel : stream.channels_from(0)) {
      if (channel.topic != topic) continue;
      const takt::view::Sample newest = stream.newest(channel.id);
      Type sample;
      if (newest.bytes &&
          takt::cdr::read(
              std::span(reinterpret_cast<const std::uint8_t*>(newest.bytes->data()), newest.bytes->size()),
              sample) &&
          accepts(sample))
        return sample;
    }
    seen = cell.wait_for(
                   takt::topics::state, [&](const auto& state) { return state.sample_number > seen; },
                   takt::test::kGenerous)
               .value()
               .sample_number;
  }
}

TEST(LiveSource, AViewerThatComesLaterGetsTheProgramsOfTheRobots) {
  const auto server = paused_server();
  ASSERT_TRUE(server->wait_for_output("ready")) << server->text;
  const std::string program = std::string(TAKT_CONFIG_DIR) + "/programs/block_assembly.lua";
  ChildProcess controller({std::string(TAKT_BIN_DIR) + "/takt-controller", program, "--cell",
                           takt::test::test_cell(), "--domain", std::to_string(takt::test::test_domain()),
                           "--pace", "lockstep", "--start", "--until", "100000", "--timeout", "60"});
  takt::ClientOptions options;
  options.cell = takt::test::test_cell();
  options.domain = static_cast<int>(takt::test::test_domain());
  options.timeout = takt::test::kGenerous;
  takt::Client client(options);
  constexpr takt::Seconds kRun{300.0};  // 45 s of a cell in lockstep
  ASSERT_TRUE(client.wait_for(
      takt::topics::state, [](const auto& state) { return state.time > 45.0; }, kRun));

  takt::view::Stream stream;
  const takt::view::LiveSource source(options, stream);
  const std::string cell = "/" + options.cell;
  const auto text = sample_of<takt_msgs::msg::Program>(client, stream, cell + "/Robot2/program",
                                                       [](const auto& one) { return !one.text.empty(); });
  std::ifstream file(program);
  const std::string wanted{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(text.text, wanted);
  EXPECT_EQ(text.controller, "takt-controller");
  std::vector<std::string> lines(1);
  for (const char c : wanted) {
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += c;
  }
  const auto steps = sample_of<takt_msgs::msg::ProgramSteps>(client, stream, cell + "/Robot1/program_steps",
                                                             [](const auto& one) { return one.finished; });
  // Sections follow each other without a gap; calls lie within them.
  std::vector<takt_msgs::msg::ProgramStep> sections;
  for (const takt_msgs::msg::ProgramStep& step : steps.steps) {
    EXPECT_GE(step.end, step.begin) << step.name;
    EXPECT_NE(lines.at(step.line - 1).find(step.name), std::string::npos) << step.name;
    if (!step.named) continue;
    if (!sections.empty()) {
      EXPECT_EQ(step.begin, sections.back().end) << step.name;
    }
    sections.push_back(step);
  }
  ASSERT_EQ(sections.size(), 2U);
  EXPECT_EQ(sections[0].name, "P into O");
  EXPECT_EQ(sections[0].begin, 0.0);
  EXPECT_GT(steps.steps.size(), 10U);
  controller.signal(SIGINT);
}

}  // namespace
