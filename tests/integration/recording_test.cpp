// A server records commands over DDS; takt-run replays the log with the same bits.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "client_lib/client.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::Event;
using takt::Reply;
using takt::State;
using takt::test::ChildProcess;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::kBin;
using takt::test::kGenerous;
using takt::test::refusal;

std::string hexadecimal_text(std::uint64_t value) {
  std::ostringstream text;
  text << std::hex << value;
  return text.str();
}

/// Output of takt-run for a log; checks its exit code.
std::string replayed(const std::vector<std::string>& arguments, int expected_code) {
  std::vector<std::string> command{kBin + "/takt-run", "replay"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  ChildProcess program(command);
  const int code = program.wait();
  EXPECT_EQ(code, expected_code) << program.text;
  return program.text;
}

void swing_arms(Client& client, int times) {
  const State now = client.state();
  for (int i = 1; i <= times; ++i) {
    for (const char* robot : {"Robot1", "Robot2"}) {
      std::vector<double> target = now.robot(robot).position;
      target[5] += 0.001 * i;
      client.send_joint_command(robot, target);
    }
    client.set_gripper("Gripper1", i % 2 == 0 ? takt::GripperAction::open : takt::GripperAction::close);
    const std::uint64_t step = client.state().step;
    ASSERT_TRUE(client.wait_for(
        takt::topics::state, [&](const State& s) { return s.step > step + 20; }, kGenerous))
        << client.status().fault;
  }
}

TEST(Recording, ARecordedFreeRunIsReplayedByTaktRun) {
  const takt::test::TemporaryDirectory directory;
  const auto log = directory / "run.taktlog";
  std::uint64_t hash = 0;
  std::string one_arm;
  {
    takt::HostOptions options = HostedService::paused();
    options.log = log;
    options.snapshots = directory / "snapshots";
    options.version = "takt-server of a test";
    options.loop.pace = takt::Pace::realtime;
    takt::ScenarioOptions scenario;
    scenario.overrides = {"solver.method=implicit"};  // the drives of level 2 are too stiff for rk2
    HostedService service(true, options, scenario);
    Client client(client_options());
    client.play();
    swing_arms(client, 5);
    client.request("save_snapshot", {{"name", "here"}});
    client.request("attach", {{"part", "P"}, {"to", "Gripper1"}});
    swing_arms(client, 3);
    client.set_level_of_detail(2);
    swing_arms(client, 3);
    client.request("restore_snapshot", {{"name", "here"}});
    swing_arms(client, 3);
    client.pause();
    client.request("set_entity_state", {{"entity", "C"}, {"position", "0.3 -0.2 0.72"}});
    client.step(50);
    client.reset();
    client.step(30);
    client.request("load_scenario", {{"uri", service.one_arm().string()}});
    client.step(100);
    const auto last = client.wait_for(
        takt::topics::state, [](const State& s) { return s.step == 100; }, kGenerous);
    ASSERT_TRUE(last.has_value());
    hash = last->state_hash;
    // Scenario files of the service go with it.
    std::filesystem::copy(service.directory.path(), directory / "scenarios");
    one_arm = (directory / "scenarios" / "one_arm.yaml").string();
    service.host.stop();
    expect_words(replayed({log.string()}, 0),
                 {"2 scenarios", "takt-server of a test", hexadecimal_text(hash).c_str()});
  }
  // Another scenario in its place is refused with a sentence.
  expect_words(replayed({log.string(), one_arm}, 2), {"service_test", "one_arm"});
  // Cut off as by a crash.
  std::filesystem::resize_file(log, std::filesystem::file_size(log) / 3);
  expect_words(replayed({log.string(), (directory / "scenarios" / "two_robots.yaml").string()}, 0),
               {"cut off", "1 scenarios"});
}

TEST(Recording, ARecordingStartsAndEndsByRequestDuringARun) {
  const takt::test::TemporaryDirectory directory;
  takt::HostOptions options = HostedService::paused();
  options.recordings = directory / "recordings";
  options.loop.pace = takt::Pace::realtime;
  HostedService service(true, options);
  Client client(client_options());
  EXPECT_EQ(refusal(client, "stop_recording").result(), takt::ControlResult::incorrect_state);
  expect_words(refusal(client, "start_recording", {{"name", "../x"}}).what(), {"not a path"});
  client.play();
  swing_arms(client, 2);
  const Reply started = client.request("start_recording", {{"name", "middle"}});
  EXPECT_EQ(refusal(client, "start_recording", {{"name", "other"}}).result(),
            takt::ControlResult::incorrect_state);
  swing_arms(client, 4);
  const Reply stopped = client.request("stop_recording");
  EXPECT_EQ(stopped.text("uri"), started.text("uri"));
  swing_arms(client, 1);
  expect_words(replayed({stopped.text("uri")}, 0), {"The same bits", "1 scenarios"});
  // A recording is never replaced by request.
  expect_words(refusal(client, "start_recording", {{"name", "middle"}}).what(), {"exists"});
}

TEST(Recording, AFullDiskIsAnEventAndTheCellContinues) {
  takt::HostOptions options = HostedService::paused();
  options.log = "/dev/full";
  HostedService service(false, options);
  Client client(client_options());
  client.request("load_scenario", {{"uri", service.two_robots().string()}});
  client.step(100);
  // The first refusal may precede this client's discovery: a request repeats it.
  expect_words(refusal(client, "stop_recording").what(), {"/dev/full", "No space left"});
  client.step(100);
  EXPECT_TRUE(client
                  .wait_for(
                      takt::topics::state, [](const State& s) { return s.step == 200; }, kGenerous)
                  .has_value());
}

TEST(Recording, TaktRecordsThePublishedSamples) {
  const takt::test::TemporaryDirectory directory;
  HostedService service;
  Client client(client_options());
  const auto file = directory / "seen.jsonl";
  ChildProcess recorder({kBin + "/takt", "--cell", takt::test::test_cell(), "--domain",
                         std::to_string(takt::test::test_domain()), "--json", "record", file.string(),
                         "--until", "0.05"});
  const auto wrote = [&] {
    std::ifstream in(file);
    std::string line;
    return static_cast<bool>(std::getline(in, line)) && !line.empty();
  };
  for (int i = 0; i < 100000 && !wrote(); ++i)
    (void)client.wait_for(
        takt::topics::status,
        [n = client.status().sample_number](const auto& s) { return s.sample_number > n; }, kGenerous);
  ASSERT_TRUE(wrote());
  client.set_level_of_detail(2);
  client.step(60);
  EXPECT_EQ(recorder.wait(), 0) << recorder.text;
  std::ifstream in(file);
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  expect_words(all, {"\"kind\":\"state\"", "\"kind\":\"event\"", "level_of_detail_changed",
                     "\"kind\":\"end\"", "\"missed\":"});
}

}  // namespace
