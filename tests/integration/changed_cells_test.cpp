// A cell after Parts with references were added or removed: controllers, threads, rules, names.
#include <gtest/gtest.h>

#include <string>

#include "client_lib/client.h"
#include "tests/support/built_programs.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::ClientError;
using Arguments = std::map<std::string, std::string>;
using takt::Event;
using takt::Seconds;
using takt::SimulationState;
using takt::State;
using takt::Status;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::kConfig;
using takt::test::kGenerous;
using takt::test::refusal;

/// A server with this scenario of config/.
struct LoadedService {
  explicit LoadedService(const std::string& scenario) {
    client.load_scenario(kConfig / "scenarios" / scenario);
    client.set_state(SimulationState::stopped);
  }
  HostedService service{false};
  Client client{client_options()};
};

TEST(ChangedCells, ControllersKeepTheirTargetsWhenDevicesComeAndGo) {
  LoadedService cell("furnace.yaml");
  cell.client.set_pace(takt::Pace::lockstep);
  cell.client.register_controller("plc", Seconds{0.008}, kGenerous, {"Furnace"});
  // Heated Parts are numbered ahead of furnaces: each of these moves the furnace among the targets.
  cell.client.request("spawn_entity", {{"name", "Rotor2"}, {"copy_of", "Rotor"}, {"position", "0 0 2"}});
  cell.client.play();
  const auto is_late = [](const Event& e) { return e.code == "controller_late"; };
  auto late = cell.client.wait_for(takt::topics::event, is_late, kGenerous);
  ASSERT_TRUE(late.has_value());
  expect_words(late->message, {"plc", "for Furnace at"});
  cell.client.set_state(SimulationState::stopped);
  cell.client.request("delete_entity", {{"entity", "Rotor2"}});
  cell.client.request("delete_entity", {{"entity", "Rotor"}});
  cell.client.play();
  late = cell.client.wait_for(takt::topics::event, is_late, kGenerous);
  ASSERT_TRUE(late.has_value());
  expect_words(late->message, {"plc", "for Furnace at"});
  EXPECT_EQ(cell.client.status().step, 0U);
}

TEST(ChangedCells, AControllerWithoutTargetsIsRemoved) {
  LoadedService cell("furnace.yaml");
  cell.client.request("spawn_entity", {{"name", "Rotor2"}, {"copy_of", "Rotor"}, {"position", "0 0 2"}});
  cell.client.register_controller("reader", Seconds{0.008}, kGenerous, {"Rotor2_heat"});
  cell.client.request("delete_entity", {{"entity", "Rotor2"}});
  const auto gone = cell.client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "controller_unregistered"; }, kGenerous);
  ASSERT_TRUE(gone.has_value());
  EXPECT_EQ(gone->subject, "reader");
}

TEST(ChangedCells, ScrewsAreDeletedBeforeThePartThatHoldsThem) {
  LoadedService cell("bev_rotor.yaml");
  const ClientError early = refusal(cell.client, "delete_entity", {{"entity", "Core1"}});
  EXPECT_EQ(early.result(), takt::ControlResult::failed);
  expect_words(early.what(), {"Core1", "Screw1", "Screw2"});
  // A copy of a screw is a loose one: in the air it falls.
  cell.client.request("spawn_entity", {{"name", "Spare"}, {"copy_of", "Screw1"}, {"position", "3 3 3"}});
  cell.client.step(100);
  const State fallen = cell.client.state();
  EXPECT_LT(fallen.component("Spare").position.z, 2.97);
  EXPECT_EQ(fallen.partner_of("Spare"), "");
  cell.client.set_state(SimulationState::stopped);
  for (const char* part : {"Screw1", "Screw2", "Core1"})
    cell.client.request("delete_entity", {{"entity", part}});
  cell.client.step(10);
  EXPECT_LT(cell.client.cell()->find_component("Core1"), 0);
}

TEST(ChangedCells, RulesThatNameADeletedPartSayNothing) {
  LoadedService incline("contact/incline.yaml");
  incline.client.request("delete_entity", {{"entity", "Holds"}});
  incline.client.step(5);
  EXPECT_LT(incline.client.cell()->find_component("Holds"), 0);
  EXPECT_GE(incline.client.cell()->find_component("Slides"), 0);

  HostedService& service = incline.service;
  const auto checked = service.file("checked.yaml", takt::test::service_scenario_text() +
                                                        "collision_checking:\n  limits:\n"
                                                        "    - {pair: [Robot1/*, P], min_clearance_m: 0.05}\n"
                                                        "  ignore: [[C, Robot2/*]]\n");
  incline.client.load_scenario(checked);
  incline.client.request("delete_entity", {{"entity", "P"}});
  incline.client.request("delete_entity", {{"entity", "C"}});
  incline.client.step(5);
  // A rule with a name that never existed is still refused.
  const auto wrong = service.file(
      "wrong.yaml", takt::test::service_scenario_text() + "collision_checking: {ignore: [[Nobody, P]]}\n");
  expect_words(refusal(incline.client, "load_scenario", {{"uri", wrong.string()}}).what(), {"Nobody"});
}

TEST(ChangedCells, NamesAreUniqueAmongPartsAndDevices) {
  LoadedService cell("furnace.yaml");
  const auto spawn = [](const std::string& name, const std::string& rename = "false") {
    return Arguments{{"name", name}, {"allow_renaming", rename}, {"copy_of", "Rotor"}, {"position", "0 0 2"}};
  };
  for (const char* taken : {"Furnace", "Rotor_heat", "Rotor"})
    EXPECT_EQ(refusal(cell.client, "spawn_entity", spawn(taken)).result(),
              takt::ControlResult::name_not_unique)
        << taken;
  // The longest name there may be has room for a number.
  const std::string longest(64, 'x');
  EXPECT_EQ(cell.client.request("spawn_entity", spawn(longest, "true")).text("entity"), longest);
  EXPECT_EQ(cell.client.request("spawn_entity", spawn(longest, "true")).text("entity"),
            std::string(62, 'x') + "_2");
  const ClientError far = refusal(cell.client, "spawn_entity",
                                  {{"name", "far"}, {"copy_of", "Rotor"}, {"position", "1e300 0 0"}});
  EXPECT_EQ(far.result(), takt::ControlResult::failed);
  expect_words(far.what(), {"position", "1e9"});
}

TEST(ChangedCells, MorePartsThanAMessageHoldsAreRefused) {
  HostedService service;
  Client client(client_options());
  const std::string text = takt::test::service_scenario_text();
  const auto with_heated_parts = [&](int count) {
    std::string parts;
    for (int i = 0; i < count; ++i)
      parts += "  H" + std::to_string(i) + ": {mesh: " + (kConfig / "meshes" / "C.obj").string() +
               ", mass_kg: 0.5, hierarchy: 3, pose: {position_m: [" + std::to_string(i) +
               ", 9, 0]}, heat: {specific_heat_J_per_kg_K: 500}}\n";
    std::string all = text;
    const std::string key = "\nparts:\n";
    return all.insert(all.find(key) + key.size(), parts);
  };
  const ClientError refused =
      refusal(client, "load_scenario", {{"uri", service.file("many.yaml", with_heated_parts(65)).string()}});
  expect_words(refused.what(), {"65 devices", "64"});
  EXPECT_EQ(client.cell()->scenario, "service_test");
  client.load_scenario(service.file("as_many_as_fit.yaml", with_heated_parts(64)));
  EXPECT_EQ(client.state().devices.size(), 64U);
  EXPECT_EQ(
      refusal(client, "spawn_entity", {{"name", "H64"}, {"copy_of", "H0"}, {"position", "0 0 9"}}).result(),
      takt::ControlResult::failed);
}

TEST(ChangedCells, AResetOfSpawnedPartsIsReportedAsAReset) {
  HostedService service;
  Client client(client_options());
  client.set_state(SimulationState::stopped);
  client.request("spawn_entity", {{"name", "Q"}, {"copy_of", "C"}, {"position", "0 0 2"}});
  while (client.wait_for(takt::topics::event, Seconds{0.0})) {
  }
  client.request("reset");
  EXPECT_TRUE(client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "reset"; }, kGenerous));
}

TEST(ChangedCells, MissingAndInvalidFilesHaveDifferentResults) {
  HostedService service;
  Client client(client_options());
  EXPECT_EQ(refusal(client, "load_scenario", {{"uri", service.wrong_key().string()}}).result(),
            takt::ControlResult::resource_parse_error);
  std::string text = takt::test::service_scenario_text();
  const auto mesh = text.find("C.obj");
  ASSERT_NE(mesh, std::string::npos);
  const auto missing = service.file("missing.yaml", text.replace(mesh, 5, "nowhere.obj"));
  const ClientError gone = refusal(client, "load_scenario", {{"uri", missing.string()}});
  EXPECT_EQ(gone.result(), takt::ControlResult::missing_assets);
  expect_words(gone.what(), {"missing.yaml", "nowhere.obj"});
  const ClientError folder = refusal(client, "load_scenario", {{"uri", service.directory.path().string()}});
  EXPECT_EQ(folder.result(), takt::ControlResult::resource_parse_error);
  expect_words(folder.what(), {"directory"});
}

TEST(Registering, ARegisteredNameIsNotGivenToAnotherController) {
  HostedService service;
  Client client(client_options());
  client.register_controller("plc", Seconds{0.008}, kGenerous, {"Robot1"});
  const ClientError refused =
      refusal(client, "register_controller", {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot2"}});
  EXPECT_EQ(refused.result(), takt::ControlResult::failed);
  expect_words(refused.what(), {"plc", "Robot1", "another name"});
  // A restarted controller has the same targets.
  client.register_controller("plc", Seconds{0.004}, kGenerous, {"Robot1"});
}

}  // namespace
