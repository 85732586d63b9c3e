// A disk that is full while takt-server records commands over DDS: an event within a second, the cell
// continues, and all written records are valid.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/resource.h>

#include <filesystem>

#include "client_lib/client.h"
#include "server/runtime/recording/command_log.h"
#include "tests/support/child_process.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::Event;
using takt::State;
using takt::test::ChildProcess;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::kGenerous;

class FullDisk : public testing::Test {
 protected:
  std::vector<std::string> server(const std::filesystem::path& log) const {
    return {std::string(TAKT_BIN_DIR) + "/takt-server",
            scenario_.string(),
            "--cell",
            takt::test::test_cell(),
            "--domain",
            std::to_string(takt::test::test_domain()),
            "--log",
            log.string()};
  }
  /// Both robots swing until the server reports the end of the recording.
  std::optional<Event> command_until_told(Client& client) {
    std::optional<Event> reported;
    const State start = client.state();
    for (int i = 1; i < 3000 && !reported; ++i) {
      for (const char* robot : {"Robot1", "Robot2"}) {
        std::vector<double> target = start.robot(robot).position;
        target[5] += 0.001 * (i % 100);
        client.send_joint_command(robot, target);
      }
      reported = client.wait_for(
          takt::topics::event, [](const Event& event) { return event.code == "recording_failed"; },
          takt::Seconds{0.02});
    }
    return reported;
  }
  /// `readable`: where this process finds the log.
  void expect_told_and_unharmed(Client& client, const std::filesystem::path& readable, const char* reason) {
    const auto reported = command_until_told(client);
    ASSERT_TRUE(reported.has_value());
    expect_words(reported->message, {"The log", "ends here", reason});
    const State then = client.state();
    const auto later = client.wait_for(
        takt::topics::state, [&](const State& s) { return s.step > then.step + 100; }, kGenerous);
    ASSERT_TRUE(later.has_value());
    EXPECT_EQ(later->epoch, then.epoch);
    EXPECT_EQ(client.status().fault, "");
    const auto log = directory_ / "copy.taktlog";
    std::filesystem::copy_file(readable, log);
    takt::LogReader reader(log);
    takt::LogEntry entry;
    std::uint64_t last_step = 0;
    int records = 0;
    for (; reader.next(entry); ++records) last_step = entry.step;
    EXPECT_GT(records, 20);
    EXPECT_GE(reported->step, last_step);
    EXPECT_LE(reported->step - last_step, 1000U) << "steps of 1 ms, in real time: reported within a second";
    ChildProcess replay({std::string(TAKT_BIN_DIR) + "/takt-run", "replay", log.string()});
    EXPECT_EQ(replay.wait(), 0) << replay.text;
  }

  const takt::test::TemporaryDirectory directory_;
  const std::filesystem::path scenario_ =
      (directory_.write("two_robots.yaml", takt::test::service_scenario_text()),
       directory_ / "two_robots.yaml");
};

TEST_F(FullDisk, AFileAtItsLimitIsReportedAndTheCellContinues) {
  const auto log = directory_ / "run.taktlog";
  ChildProcess program(server(log));
  ASSERT_TRUE(program.wait_for_output("ready")) << program.text;
  Client client(client_options());
  // Only at this point: the shared memory of DDS consists of files too.
  const rlimit limit{std::filesystem::file_size(log) + 20'000, RLIM_INFINITY};
  ASSERT_EQ(prlimit(program.pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
  expect_told_and_unharmed(client, log, "File too large");
}

TEST_F(FullDisk, AFullFileSystemIsReportedAndTheCellContinues) {
  if (geteuid() != 0) GTEST_SKIP() << "mounting a small file system needs root";
  const auto small = directory_ / "small";
  std::filesystem::create_directory(small);
  // The mount is seen by the server alone, and goes with it.
  std::string command = "mount -t tmpfs -o size=32k none " + small.string() + " && exec";
  for (const std::string& word : server(small / "run.taktlog")) command += " '" + word + "'";
  ChildProcess program({"/usr/bin/unshare", "--mount", "/bin/sh", "-c", command});
  if (!program.wait_for_output("ready")) {
    program.wait();
    GTEST_SKIP() << "no small file system could be mounted here: " << program.text;
  }
  Client client(client_options());
  expect_told_and_unharmed(
      client, "/proc/" + std::to_string(program.pid()) + "/root" + (small / "run.taktlog").string(),
      "No space left");
}

}  // namespace
