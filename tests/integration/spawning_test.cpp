// Parts are added to and removed from a running server, and report their state, over DDS.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>

#include "client_lib/client.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::ClientError;
using Arguments = std::map<std::string, std::string>;
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

/// Stops the cell, sends the request, and returns the first instant of the new content.
State exchanged(Client& client, const std::string& name, const Arguments& arguments) {
  client.set_state(SimulationState::stopped);
  const Reply reply = client.request(name, arguments);
  const auto state = client.wait_for(
      takt::topics::state,
      [&](const State& s) {
        return std::to_string(s.cell->scenario_generation) == reply.text("scenario_generation");
      },
      kGenerous);
  if (!state) throw ClientError(ClientError::Kind::timeout, "no state after " + name);
  return *state;
}

TEST(Spawning, ACopyOfAPartIsSpawnedBehavesLikeItAndIsDeleted) {
  HostedService service;
  Client client(client_options());
  const auto first = client.cell();
  const ClientError early =
      refusal(client, "spawn_entity", {{"name", "C2"}, {"copy_of", "C"}, {"position", "0.3 0.2 0.9"}});
  EXPECT_EQ(early.result(), takt::ControlResult::incorrect_state);
  expect_words(early.what(), {"stopped", "paused"});

  const State there = exchanged(client, "spawn_entity",
                                {{"name", "C2"},
                                 {"copy_of", "C"},
                                 {"position", "0.3 0.2 0.9"},
                                 {"orientation", "0 0 0.7071067811865476 0.7071067811865476"}});
  EXPECT_EQ(there.cell->components.size(), first->components.size() + 1);
  const int copy = there.cell->find_component("C2");
  const int original = there.cell->find_component("C");
  ASSERT_GE(copy, 0);
  EXPECT_EQ(there.cell->components[static_cast<std::size_t>(copy)].mass, 0.5);
  EXPECT_EQ(there.cell->components[static_cast<std::size_t>(copy)].vertices,
            there.cell->components[static_cast<std::size_t>(original)].vertices);
  EXPECT_NEAR(there.component("C2").position.z, 0.9, 1e-12);
  EXPECT_NEAR(there.component("C2").orientation.z, std::sqrt(0.5), 1e-12);
  // In the air without holder: it falls by g t^2 / 2.
  client.step(50);
  const auto fallen = client.wait_for(
      takt::topics::state, [](const State& s) { return s.step == 50; }, kGenerous);
  ASSERT_TRUE(fallen.has_value());
  EXPECT_NEAR(fallen->component("C2").position.z, 0.9 - 0.5 * 9.80665 * 0.05 * 0.05, 1e-6);
  // The first step is taken at t = 0; the Parts on the table stay.
  EXPECT_NEAR(fallen->component("C").position.z, there.component("C").position.z, 1e-4);

  const State gone = exchanged(client, "delete_entity", {{"entity", "C2"}});
  EXPECT_LT(gone.cell->find_component("C2"), 0);
  EXPECT_EQ(gone.cell->components.size(), first->components.size());
}

TEST(Spawning, ANewPartComesFromAMeshFile) {
  HostedService service;
  Client client(client_options());
  const std::string mesh = std::string(TAKT_CONFIG_DIR) + "/meshes/P.obj";
  const State there = exchanged(client, "spawn_entity",
                                {{"name", "P"},
                                 {"allow_renaming", "true"},
                                 {"uri", mesh},
                                 {"mass", "0.25"},
                                 {"hierarchy", "4"},
                                 {"position", "0.1,0.3,1.1"}});
  const int part = there.cell->find_component("P_2");
  ASSERT_GE(part, 0);
  EXPECT_EQ(there.cell->components[static_cast<std::size_t>(part)].mass, 0.25);
  EXPECT_EQ(there.cell->components[static_cast<std::size_t>(part)].hierarchy, 4);
  const auto expect_refused = [&](Arguments with, std::optional<takt::ControlResult> result,
                                  const char* word) {
    Arguments arguments{{"name", "X"}, {"uri", mesh}, {"mass", "1"}, {"position", "0 0 2"}};
    for (const auto& [key, value] : with) arguments[key] = value;
    const ClientError error = refusal(client, "spawn_entity", arguments);
    EXPECT_EQ(error.result(), result) << error.what();
    EXPECT_EQ(error.kind(), result ? ClientError::Kind::refused : ClientError::Kind::invalid);
    expect_words(error.what(), {word});
  };
  expect_refused({{"name", "P"}}, takt::ControlResult::name_not_unique, "P");
  expect_refused({{"name", "not a name"}}, takt::ControlResult::name_invalid, "letters");
  expect_refused({{"uri", "/nowhere.obj"}}, takt::ControlResult::no_resource, "/nowhere.obj");
  expect_refused({{"uri", service.wrong_key().string()}}, takt::ControlResult::spawn_parse_error,
                 "wrong_key.yaml");
  expect_refused({{"mass", "-1"}}, takt::ControlResult::failed, "mass");
  expect_refused({{"position", "0 0"}}, takt::ControlResult::failed, "position");
  expect_refused({{"position", "0 0 inf"}}, std::nullopt, "position");  // by the client
  expect_refused({{"orientation", "0 0 0 2"}}, takt::ControlResult::failed, "orientation");
  expect_refused({{"copy_of", "C"}}, takt::ControlResult::failed, "copy_of");
  EXPECT_EQ(refusal(client, "delete_entity", {{"entity", "nobody"}}).result(),
            takt::ControlResult::not_found);
  expect_words(refusal(client, "delete_entity", {{"entity", "Table1"}}).what(), {"no Part"});
  EXPECT_EQ(client.cell()->scenario_generation, there.cell->scenario_generation);
}

TEST(Spawning, AResetOfAllRestoresTheScenario) {
  HostedService service;
  Client client(client_options());
  exchanged(client, "delete_entity", {{"entity", "P"}});
  State now = exchanged(client, "spawn_entity", {{"name", "Q"}, {"copy_of", "C"}, {"position", "0 0 2"}});
  client.step(3);
  // Scopes time and state keep spawned Parts.
  client.request("reset", {{"scope", "3"}});
  EXPECT_GE(client.cell()->find_component("Q"), 0);
  const Reply reply = client.request("reset");
  const auto back = client.wait_for(
      takt::topics::state,
      [&](const State& s) {
        return std::to_string(s.cell->scenario_generation) == reply.text("scenario_generation");
      },
      kGenerous);
  ASSERT_TRUE(back.has_value());
  EXPECT_LT(back->cell->find_component("Q"), 0);
  EXPECT_GE(back->cell->find_component("P"), 0);
  // Without spawned Parts a reset is a plain reset again.
  client.reset();
  EXPECT_EQ(client.cell()->scenario_generation, back->cell->scenario_generation);
}

TEST(Spawning, RegisteredControllersStay) {
  HostedService service;
  Client client(client_options());
  client.set_pace(takt::Pace::lockstep);
  client.register_controller("plc", Seconds{0.008}, kGenerous, {"Robot1"});
  exchanged(client, "spawn_entity", {{"name", "Q"}, {"copy_of", "C"}, {"position", "0 0 2"}});
  client.play();
  const auto waiting = client.wait_for(
      takt::topics::status,
      [](const Status& s) { return !s.waiting_for.empty() && s.waiting_for[0] == "plc"; }, kGenerous);
  EXPECT_TRUE(waiting.has_value());
}

TEST(Entities, EntitiesAreListedWithTheirState) {
  HostedService service;
  Client client(client_options());
  EXPECT_EQ(client.get_entities().size(), client.cell()->components.size());
  const Reply parts = client.request("get_entities", {{"type", "part"}});
  expect_words(parts.message, {"2 of "});
  expect_words(parts.text("entities"), {"\"P\"", "\"C\"", "0.3"});
  EXPECT_EQ(client.get_entities("Gripper1*").size(), 3U);
  EXPECT_EQ(client.get_entities("nobody").size(), 0U);

  const Reply state = client.request("get_entity_state", {{"entity", "C"}});
  EXPECT_EQ(state.text("position"), "0.3 -0.2 0.7");
  EXPECT_EQ(state.text("orientation"), "0 0 0 1");
  EXPECT_EQ(state.text("type"), "part");
  const ClientError unknown = refusal(client, "get_entity_state", {{"entity", "nobody"}});
  EXPECT_EQ(unknown.result(), takt::ControlResult::not_found);
  expect_words(unknown.what(), {"Table1"});
}

}  // namespace
