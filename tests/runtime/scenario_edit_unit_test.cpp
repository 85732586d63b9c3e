// Added and removed Parts, by the scenario: names in use, properties of a copy, and their replay. And
// requests about existing components: required and permitted arguments.
#include "server/runtime/host/scenario_edit.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "server/devices/screw_joints.h"
#include "server/runtime/requests/control.h"
#include "tests/support/text_requests.h"

namespace takt {
namespace {

std::string heat_device_name(const std::string& part) {
  return part_device_name(part, device_type("heat"));
}
std::string thread_device_name(const std::string& part) {
  return part_device_name(part, device_type("thread"));
}

/// One of each kind; A is warm and screwed into B.
Scenario one_of_each() {
  Scenario scenario;
  scenario.parts.resize(2);
  scenario.parts[0].name = "A";
  ScenarioScrewJoint joint;
  joint.held_by.component = "B";
  const DeviceType *const heat = &device_type("heat"), *const thread = &device_type("thread");
  scenario.parts[0].devices = {{"", heat, heat->fresh()}, {"", thread, joint}};
  scenario.parts[0].mass_kg = 2.0;
  scenario.parts[0].inertia_kg_m2 = Mat3::Identity();
  scenario.parts[1].name = "B";
  scenario.grounds.resize(1);
  scenario.grounds[0].name = "Floor";
  scenario.robots.resize(1);
  scenario.robots[0].name = "Arm";
  scenario.grippers.resize(1);
  scenario.grippers[0].name = "Hand";
  for (const auto& [name, key] : {std::pair{"Oven", "furnaces"}, std::pair{"Driver", "screwdrivers"}})
    scenario.devices.push_back({name, &device_type(key), device_type(key).fresh()});
  scenario.processes = {{"first", 1, false, {"B"}}, {"second", 1, false, {"A"}}};
  return scenario;
}

requests::SpawnEntity copy_of(const std::string& original, const std::string& name) {
  requests::SpawnEntity request;
  request.name = name;
  request.copy_of = original;
  return request;
}

template <Request Type>
Refusal refusal_of_change(const Type& request) {
  auto result = changed(one_of_each(), request);
  if (auto* refusal = std::get_if<Refusal>(&result)) return *refusal;
  ADD_FAILURE() << "it was done";
  return {};
}

void expect_words_in(const std::string& text, const std::string& words) {
  EXPECT_NE(text.find(words), std::string::npos) << words << " is not in: " << text;
}

TEST(ScenarioChanges, NamesAreUniqueAmongAllComponents) {
  const Scenario scenario = one_of_each();
  for (const std::string& name :
       {std::string("A"), std::string("Floor"), std::string("Arm"), std::string("Hand"), std::string("Oven"),
        std::string("Driver"), heat_device_name("A"), thread_device_name("A")}) {
    const Refusal refusal = refusal_of_change(copy_of("B", name));
    EXPECT_EQ(refusal.result, ControlResult::name_not_unique);
    expect_words_in(refusal.message, "There is a '" + name + "' in this cell already");
    requests::SpawnEntity renamed = copy_of("B", name);
    renamed.allow_renaming = true;
    EXPECT_EQ(std::get<ChangedScenario>(changed(scenario, renamed)).entity, name + "_2");
  }
  // The device that would come with it is taken, though its name is not.
  Scenario crowded = scenario;
  crowded.grounds[0].name = heat_device_name("X");
  EXPECT_EQ(std::get<Refusal>(changed(crowded, copy_of("A", "X"))).result, ControlResult::name_not_unique);
  EXPECT_EQ(std::get<ChangedScenario>(changed(crowded, copy_of("B", "X"))).entity, "X");
  const Refusal wrong = refusal_of_change(copy_of("B", "no name"));
  EXPECT_EQ(wrong.result, ControlResult::name_invalid);
  expect_words_in(wrong.message, "The name 'no name' is not possible");
  const Refusal nothing = refusal_of_change(copy_of("Q", "X"));
  EXPECT_EQ(nothing.result, ControlResult::not_found);
  expect_words_in(nothing.message, "There is no Part 'Q' to copy.");
  requests::SpawnEntity lacking{.name = "X"};
  expect_words_in(refusal_of_change(lacking).message, "either 'uri', a mesh file, or 'copy_of'");
  lacking.uri = "no/such/mesh.obj";
  expect_words_in(refusal_of_change(lacking).message, "needs the argument 'mass'");
  lacking.mass = 1.0;
  EXPECT_EQ(refusal_of_change(lacking).result, ControlResult::no_resource);
}

TEST(ScenarioChanges, ACopyKeepsTheProcessAndScalesTheMass) {
  requests::SpawnEntity request = copy_of("A", "X");
  request.mass = 6.0;
  request.hierarchy = 7;
  const auto result = std::get<ChangedScenario>(changed(one_of_each(), request));
  const ScenarioPart& part = result.scenario.parts.back();
  EXPECT_EQ(part.name, "X");
  EXPECT_EQ(part.mass_kg, 6.0);
  EXPECT_EQ(part.hierarchy, 7);
  EXPECT_EQ((*part.inertia_kg_m2)(0, 0), 3.0) << "of the same shape, three times as heavy";
  EXPECT_EQ(part.device("thread"), nullptr);
  EXPECT_NE(part.device("heat"), nullptr);
  EXPECT_EQ(result.scenario.processes[0].members, std::vector<std::string>{"B"});
  EXPECT_EQ(result.scenario.processes[1].members, (std::vector<std::string>{"A", "X"}));
  request.mass.reset();
  const auto as_heavy = std::get<ChangedScenario>(changed(one_of_each(), request));
  EXPECT_EQ((*as_heavy.scenario.parts.back().inertia_kg_m2)(0, 0), 1.0);
}

TEST(ScenarioChanges, OnlyPartsThatHoldNothingAreDeleted) {
  const Refusal held = refusal_of_change(requests::DeleteEntity{"B"});
  EXPECT_EQ(held.result, ControlResult::failed);
  expect_words_in(held.message, "'B' cannot go while something is screwed into it: A; delete that first.");
  for (const char* other : {"Floor", "Arm", "Hand", "Oven", "Driver", "Hand/jaw"}) {
    const Refusal refusal = refusal_of_change(requests::DeleteEntity{other});
    EXPECT_EQ(refusal.result, ControlResult::failed);
    expect_words_in(refusal.message, std::string("'") + other + "' is no Part; only Parts can be deleted.");
  }
  EXPECT_EQ(refusal_of_change(requests::DeleteEntity{"Q"}).result, ControlResult::not_found);
  const auto gone = std::get<ChangedScenario>(changed(one_of_each(), requests::DeleteEntity{"A"}));
  EXPECT_EQ(gone.scenario.deleted, std::vector<std::string>{"A"});
  EXPECT_TRUE(gone.scenario.processes[1].members.empty());
}

TEST(ScenarioChanges, ChangesAreTakenFromRequestsInOrder) {
  requests::SpawnEntity x = copy_of("B", "X");
  x.position = {1, 2, 3};
  const std::vector<requests::Any> wanted{x, requests::Reset{}, requests::SaveSnapshot{"s"},
                                          requests::DeleteEntity{"A"}};
  const Scenario result = with_changes(one_of_each(), wanted);
  ASSERT_EQ(result.parts.size(), 2U);
  EXPECT_EQ(result.parts[0].name, "B");
  EXPECT_EQ(result.parts[1].name, "X");
  EXPECT_EQ(result.parts[1].X_WB.p, Vec3(1, 2, 3));
  try {
    with_changes(one_of_each(), std::vector<requests::Any>{requests::DeleteEntity{"Q"}});
    ADD_FAILURE() << "it was done";
  } catch (const std::runtime_error& error) {
    expect_words_in(error.what(), "There is no Part 'Q' in this cell.");
  }
}

CellDescription parts_and_table() {
  CellDescription cell;
  cell.components.resize(2);
  cell.components[0].name = "P";
  cell.components[1].name = "Table";
  return cell;
}

TEST(EntityRequests, MissingArgumentsAreReported) {
  struct Row {
    const char* request;
    test::TextArguments arguments;
    ControlResult result;
    const char* words;
  };
  const Row rows[] = {
      {"get_entities", {{"type", "robot"}}, ControlResult::failed, "part, gripper or ground"},
      {"get_entity_state", {}, ControlResult::failed, "'entity'"},
      {"get_entity_state", {{"entity", "Q"}}, ControlResult::not_found, "Q"},
      {"set_entity_state", {{"position", "1 2 3"}}, ControlResult::failed, "'entity'"},
      {"set_entity_state", {{"entity", "Q"}, {"position", "1 2 3"}}, ControlResult::not_found, "Q"},
      {"set_entity_state", {{"entity", "P"}, {"position", "1 2"}}, ControlResult::failed, "'position'"},
      {"set_entity_state", {{"entity", "P"}, {"linear_velocity", "x"}}, ControlResult::failed, "linear_vel"},
      {"attach", {{"part", "P"}}, ControlResult::failed, "'to'"},
      {"attach", {{"part", "Q"}, {"to", "P"}}, ControlResult::not_found, "Q"},
      {"attach", {{"part", "P"}, {"to", "Q"}}, ControlResult::not_found, "Q"},
      {"detach", {}, ControlResult::failed, "'part'"},
      {"detach", {{"part", "Q"}}, ControlResult::not_found, "Q"},
  };
  for (const Row& row : rows) {
    const CellDescription cell = parts_and_table();
    const auto parsed = parse(test::text_request(5, row.request, row.arguments), &cell);
    const auto* reply = std::get_if<Refusal>(&parsed);
    ASSERT_NE(reply, nullptr) << row.request << " was accepted, though " << row.words;
    EXPECT_EQ(reply->result, row.result) << reply->message;
    expect_words_in(reply->message, row.words);
  }
}

TEST(EntityRequests, EachFieldOfAStateIsSetAlone) {
  const CellDescription cell = parts_and_table();
  const auto action = [&](const test::TextArguments& more) {
    test::TextArguments arguments{{"entity", "P"}};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto parsed = parse(test::text_request(5, "set_entity_state", arguments), &cell);
    return std::get<requests::SetEntityState>(std::get<requests::Any>(parsed));
  };
  using Vector3 = takt_msgs::msg::Vector3;
  EXPECT_EQ(action({{"position", "1 2 3"}}).position, (Vector3{1, 2, 3}));
  EXPECT_EQ(action({{"orientation", "0 0 0 1"}}).orientation, takt_msgs::msg::Quaternion{});
  EXPECT_EQ(action({{"linear_velocity", "1 0 0"}}).linear_velocity, (Vector3{1, 0, 0}));
  const requests::SetEntityState turning = action({{"angular_velocity", "0 0 2"}});
  EXPECT_EQ(turning.angular_velocity, (Vector3{0, 0, 2}));
  EXPECT_FALSE(turning.position || turning.orientation || turning.linear_velocity);
  for (const ComponentType category : {ComponentType::part, ComponentType::gripper, ComponentType::ground}) {
    const auto parsed =
        parse(test::text_request(5, "get_entities", {{"type", std::string(to_string(category))}}), &cell);
    EXPECT_EQ(std::get<requests::GetEntities>(std::get<requests::Any>(parsed)).type, category);
  }
}

}  // namespace
}  // namespace takt
