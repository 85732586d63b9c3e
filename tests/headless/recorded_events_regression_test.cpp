// Events in a recording of takt-run: each once, in the step that the report gives.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <tuple>

#include "client_lib/recording/mcap_reader.h"
#include "client_lib/recording/sample.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

TEST(RecordedEvents, EventsComeOnceAndInTheirOwnStep) {
  TemporaryDirectory directory;
  const std::string recording = directory.path() / "run.mcap", file = directory.path() / "run.json";
  ChildProcess run({TAKT_BIN_DIR "/takt-run", "run", TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml",
                    "--duration", "12", "--quiet", "--mcap", recording, "--report", file});
  ASSERT_EQ(run.wait(), 0) << run.text;
  std::ifstream in(file);
  const nlohmann::json report = nlohmann::json::parse(in);
  std::multiset<std::pair<std::uint64_t, std::string>> wanted, found;
  for (const auto& change : report.at("connection_changes"))
    wanted.emplace(change.at("step").get<std::uint64_t>(), change.at("part").get<std::string>());
  ASSERT_GT(wanted.size(), 5U);
  recording::McapReader reader(recording);
  std::uint64_t last_ns = 0;
  reader.read([&](const recording::McapMessage& message) {
    EXPECT_GE(message.log_time_ns, last_ns);
    last_ns = message.log_time_ns;
    if (message.channel->type != "takt_msgs/msg/Event") return true;
    const auto event = recording::to_json(reader.types(), message.channel->type, message.sample);
    if (event.at("code") != "connection_changed") return true;
    const auto step = event.at("step").get<std::uint64_t>();
    found.emplace(step, event.at("subject").get<std::string>());
    EXPECT_EQ(message.log_time_ns, step * 1'000'000U);
    return true;
  });
  EXPECT_EQ(found, wanted);
}

// The last status is of the same run: its times and rates are those of the report.
TEST(RecordedStatus, RatesAreThoseOfTheReport) {
  TemporaryDirectory directory;
  const std::string recording = directory.path() / "run.mcap", file = directory.path() / "run.json";
  ChildProcess run({TAKT_BIN_DIR "/takt-run", "run", TAKT_CONFIG_DIR "/scenarios/contact/sliding_block.yaml",
                    "--duration", "0.3", "--pace", "realtime", "--factor", "2", "--quiet", "--mcap",
                    recording, "--report", file});
  ASSERT_EQ(run.wait(), 0) << run.text;
  std::ifstream in(file);
  const nlohmann::json report = nlohmann::json::parse(in);
  recording::McapReader reader(recording);
  recording::Json status;
  reader.read([&](const recording::McapMessage& message) {
    if (message.channel->type == "takt_msgs/msg/Status")
      status = recording::to_json(reader.types(), message.channel->type, message.sample);
    return true;
  });
  for (const char* name : {"time", "wall_time", "real_time_factor", "computation_ratio", "step"})
    EXPECT_EQ(status.at(name).get<double>(), report.at(name).get<double>()) << name;
  EXPECT_EQ(status.at("pace_factor"), 2.0);
  EXPECT_LE(report.at("real_time_factor").get<double>(), 2.1);
  // Waiting for the next step takes no computation.
  EXPECT_LT(report.at("computation_ratio").get<double>(), report.at("wall_time").get<double>() / 0.3);
}

}  // namespace
}  // namespace takt::test
