// Scenarios are loaded, exchanged and unloaded in a running server, over DDS.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <thread>

#include "client_lib/client.h"
#include "tests/support/child_process.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"
#include "tests/support/process_resources.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::Event;
using takt::Reply;
using takt::Seconds;
using takt::SimulationState;
using takt::State;
using takt::Status;
using takt::test::HostedService;

using takt::test::client_options;
using takt::test::expect_words;
using takt::test::kGenerous;
using takt::test::refusal;

std::optional<State> state_of_scenario(const Client& client, const std::string& scenario) {
  return client.wait_for(
      takt::topics::state, [&](const State& s) { return s.cell->scenario == scenario; }, kGenerous);
}

std::optional<Status> status_in(const Client& client, SimulationState state) {
  return client.wait_for(
      takt::topics::status, [&](const Status& s) { return s.state == state; }, kGenerous);
}

TEST(Hosting, AnInvalidFileIsReportedAndTheCellContinues) {
  HostedService service;
  Client client(client_options());
  client.play();
  const auto before = client.wait_for(
      takt::topics::state, [](const State& s) { return s.step > 10; }, kGenerous);
  ASSERT_TRUE(before.has_value());
  const ClientError wrong = refusal(client, "load_scenario", {{"uri", service.wrong_key().string()}});
  EXPECT_EQ(wrong.result(), takt::ControlResult::resource_parse_error);
  expect_words(wrong.what(), {"wrong_key.yaml", ":3:", "duration"});
  const auto reported = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "scenario_refused"; }, kGenerous);
  ASSERT_TRUE(reported.has_value());
  expect_words(reported->message, {"wrong_key.yaml", "duration"});

  const ClientError missing = refusal(client, "load_scenario", {{"uri", "/nowhere/at_all.yaml"}});
  EXPECT_EQ(missing.result(), takt::ControlResult::not_found);
  expect_words(missing.what(), {"/nowhere/at_all.yaml"});
  EXPECT_EQ(refusal(client, "load_scenario").result(), takt::ControlResult::failed);

  const std::uint64_t step = client.state().step;
  const auto later = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.step > step + 10; }, kGenerous);
  ASSERT_TRUE(later.has_value());
  EXPECT_EQ(later->epoch, before->epoch);
  EXPECT_EQ(later->cell->scenario_generation, before->cell->scenario_generation);
  EXPECT_EQ(client.get_state(), SimulationState::playing);
}

TEST(Hosting, AnotherScenarioWithOtherRobotsTakesThePlace) {
  HostedService service;
  Client client(client_options());
  const auto first = client.cell();
  ASSERT_EQ(first->robots.size(), 2U);
  client.step(30);
  client.request("set_pace", {{"pace", "free"}});
  const auto before = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "pace_changed"; }, kGenerous);
  ASSERT_TRUE(before.has_value());

  const Reply reply = client.request("load_scenario", {{"uri", "file://" + service.one_arm().string()}});
  expect_words(reply.message, {"one_arm", "stopped"});
  const auto fresh = state_of_scenario(client, "one_arm");
  ASSERT_TRUE(fresh.has_value());
  EXPECT_EQ(fresh->step, 0U);
  ASSERT_EQ(fresh->robots.size(), 1U);
  EXPECT_EQ(fresh->cell->robots[0].name, "Arm");
  EXPECT_EQ(fresh->cell->grippers.size(), 0U);
  EXPECT_GT(fresh->cell->scenario_generation, first->scenario_generation);
  EXPECT_EQ(reply.text("scenario_generation"), std::to_string(fresh->cell->scenario_generation));
  EXPECT_EQ(client.get_state(), SimulationState::stopped);
  EXPECT_TRUE(client.connected());

  // Event numbers are consecutive: no event is missing or repeated.
  const auto loaded = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "scenario_loaded"; }, kGenerous);
  ASSERT_TRUE(loaded.has_value());
  EXPECT_EQ(loaded->missed_before, 0U);
  EXPECT_GT(loaded->sequence_number, before->sequence_number);

  // The new robot is commanded through the same client; the old ones are gone.
  std::vector<double> target = fresh->robot("Arm").position;
  target[5] += 0.001;
  client.send_joint_command("Arm", target);
  std::optional<State> moved;
  for (int i = 0; i < 1000 && !moved; ++i) {
    client.step(10);
    const State now = client.state();
    if (std::abs(now.robot("Arm").position[5] - target[5]) < 1e-12) moved = now;
  }
  EXPECT_TRUE(moved.has_value());
  EXPECT_THROW(client.send_joint_command("Robot1", target), ClientError);
}

TEST(Hosting, ACommandForARemovedRobotIsReported) {
  HostedService service;
  Client client(client_options());
  client.send_joint_command("Robot1", client.state().robot("Robot1").position);
  client.request("load_scenario", {{"uri", service.one_arm().string()}});
  const auto reported = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "unknown_robot"; }, kGenerous);
  ASSERT_TRUE(reported.has_value());
  EXPECT_EQ(reported->subject, "Robot1");
  expect_words(reported->message, {"Arm"});
  // And is heard again when it is back.
  client.request("load_scenario", {{"uri", service.two_robots().string()}});
  ASSERT_TRUE(state_of_scenario(client, "service_test").has_value());
  std::vector<double> target = client.state().robot("Robot1").position;
  target[5] += 0.001;
  std::optional<State> moved;
  for (int i = 0; i < 1000 && !moved; ++i) {
    client.send_joint_command("Robot1", target);
    client.step(10);
    const State now = client.state();
    if (std::abs(now.robot("Robot1").position[5] - target[5]) < 1e-12) moved = now;
  }
  EXPECT_TRUE(moved.has_value());
}

TEST(Hosting, AnEmptyServerLoadsAndUnloads) {
  HostedService service(false);
  Client client(client_options());
  EXPECT_EQ(client.get_state(), SimulationState::no_scenario);
  ASSERT_TRUE(status_in(client, SimulationState::no_scenario).has_value());
  EXPECT_TRUE(client.cell()->components.empty());
  for (const char* name : {"step", "reset"}) {
    const ClientError error = refusal(client, name);
    EXPECT_EQ(error.result(), takt::ControlResult::incorrect_state) << name;
    expect_words(error.what(), {"load_scenario"});
  }
  EXPECT_EQ(refusal(client, "no_such_request").result(), takt::ControlResult::unsupported);
  EXPECT_EQ(refusal(client, "unload_scenario").result(), takt::ControlResult::no_scenario_loaded);
  EXPECT_EQ(refusal(client, "reload_scenario").result(), takt::ControlResult::no_scenario_loaded);
  expect_words(client.request("get_features").text("requests"), {"load_scenario", "unload_scenario"});

  client.request("load_scenario", {{"uri", service.one_arm().string()}});
  ASSERT_TRUE(state_of_scenario(client, "one_arm").has_value());
  client.step(5);
  const Reply gone = client.request("unload_scenario");
  expect_words(gone.message, {"one_arm"});
  EXPECT_EQ(client.get_state(), SimulationState::no_scenario);
  ASSERT_TRUE(status_in(client, SimulationState::no_scenario).has_value());
  client.request("load_scenario", {{"uri", service.two_robots().string()}});
  EXPECT_EQ(client.get_state(), SimulationState::stopped);
  ASSERT_TRUE(state_of_scenario(client, "service_test").has_value());
}

TEST(Hosting, AReloadReadsTheFileWithTheSameOverrides) {
  HostedService service;
  Client client(client_options());
  client.request("load_scenario", {{"uri", service.one_arm().string()},
                                   {"overrides", "solver.step_s=0.004\nparts.Q.mass_kg=0.7"}});
  auto state = state_of_scenario(client, "one_arm");
  ASSERT_TRUE(state.has_value());
  EXPECT_EQ(state->cell->step_size, 0.004);
  EXPECT_EQ(state->cell->components[0].mass, 0.7);
  const std::uint32_t scenario_generation = state->cell->scenario_generation;
  // The file has changed meanwhile: Q is further up.
  std::string text;
  {
    std::stringstream stream;
    stream << std::ifstream(service.one_arm()).rdbuf();
    text = stream.str();
  }
  text.replace(text.find("-0.2, 0.7"), 9, "-0.2, 1.7");
  service.file("one_arm.yaml", text);
  client.step(7);
  client.request("reload_scenario");
  state = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.cell->scenario_generation > scenario_generation; },
      kGenerous);
  ASSERT_TRUE(state.has_value());
  EXPECT_EQ(state->step, 0U);
  EXPECT_EQ(state->cell->step_size, 0.004);
  EXPECT_EQ(state->cell->components[0].mass, 0.7);
  EXPECT_NEAR(state->component("Q").position.z, 1.7, 1e-12);
}

TEST(Hosting, ThePaceIsKept) {
  HostedService service;
  Client client(client_options());
  client.set_pace(takt::Pace::realtime, 2.5);
  client.request("reload_scenario");
  const Reply state = client.request("get_state");
  EXPECT_EQ(state.text("pace"), "realtime");
  EXPECT_EQ(state.text("factor"), "2.5");
}

TEST(Hosting, PendingStepsAreAnsweredWhenTheScenarioIsUnloaded) {
  HostedService service;
  Client stepping(client_options());
  Client loading(client_options());
  std::optional<ClientError> refused;
  std::thread waiting([&] { refused = refusal(stepping, "step", {{"steps", "1000000000"}}); });
  ASSERT_TRUE(loading
                  .wait_for(
                      takt::topics::state, [](const State& s) { return s.step > 0; }, kGenerous)
                  .has_value());
  loading.request("unload_scenario");
  waiting.join();
  ASSERT_TRUE(refused.has_value());
  EXPECT_EQ(refused->kind(), ClientError::Kind::refused);
  expect_words(refused->what(), {"not taken"});
}

TEST(Hosting, TwentyReloadsLeaveNothingBehind) {
  HostedService service;
  Client client(client_options());
  const auto reload = [&](const std::filesystem::path& file) {
    const Reply reply = client.request("load_scenario", {{"uri", file.string()}});
    const std::string world = reply.text("scenario_generation");
    ASSERT_TRUE(client
                    .wait_for(
                        takt::topics::state,
                        [&](const State& s) { return std::to_string(s.cell->scenario_generation) == world; },
                        kGenerous)
                    .has_value());
    client.step(5);
  };
  // Memory that a process allocates once only is allocated after a few rounds.
  for (int i = 0; i < 4; ++i) {
    reload(service.one_arm());
    reload(service.two_robots());
  }
  const auto before = takt::test::process_resources();
  for (int i = 0; i < 10; ++i) {
    reload(service.one_arm());
    reload(service.two_robots());
  }
  const auto after = takt::test::process_resources();
  EXPECT_EQ(after.threads, before.threads);
  EXPECT_EQ(after.file_descriptors, before.file_descriptors);
  // One model of this cell with its messages takes several megabytes: twenty of them would show.
  EXPECT_LT(after.allocated_bytes, before.allocated_bytes + 4.0e6);
}

TEST(Hosting, TheProgramStartsWithoutAScenario) {
  const std::string bin = TAKT_BIN_DIR;
  const std::string cell = takt::test::test_cell() + "_empty";
  takt::test::ChildProcess server({bin + "/takt-server", "--cell", cell, "--domain",
                                   std::to_string(takt::test::test_domain()), "--pace", "free"});
  ASSERT_TRUE(server.wait_for_output("no scenario")) << server.text;
  takt::ClientOptions options = client_options();
  options.cell = cell;
  Client client(options);
  EXPECT_EQ(client.get_state(), SimulationState::no_scenario);
  client.request("load_scenario", {{"uri", std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml"},
                                   {"level_of_detail", "1"}});
  client.step(3);
  EXPECT_EQ(client.request("get_state").text("step"), "3");
  client.request("unload_scenario");
  client.set_state(SimulationState::quitting);
  EXPECT_EQ(server.wait(), 0) << server.text;
}

}  // namespace
