// The takt requests of simulation_interfaces requests, and the early refusals: result and sentence of each.
// And replies that lack fields of the response.
#include <gtest/gtest.h>

#include "server/dds/ros_service_messages.h"

namespace takt::ros {
namespace {

void expect_no(const Question& question, ControlResult result, const std::string& words) {
  const auto* refused = std::get_if<Refusal>(&question);
  ASSERT_NE(refused, nullptr) << "it was asked, though " << words;
  EXPECT_EQ(refused->result, result) << refused->message;
  EXPECT_NE(refused->message.find(words), std::string::npos) << refused->message;
}

std::string argument_of(const Question& question, const std::string& name) {
  const auto* asked = std::get_if<Asked>(&question);
  if (asked == nullptr) return std::get<Refusal>(question).message;
  for (const auto& [key, value] : asked->request.arguments)
    if (key == name) return text_of(value);
  return "no " + name;
}

TEST(RosQuestions, RequestsAboutWorldsNeedAFile) {
  srv::LoadWorld_Request load;
  expect_no(ask(load), ControlResult::uri_missing, "The uri of a scenario file is missing.");
  load.world_resource.resource_string = "takt_scenario: 1";
  expect_no(ask(load), ControlResult::unsupported, "cannot be passed as text here");
  load.world_resource.uri = "cell.yaml";
  EXPECT_EQ(argument_of(ask(load), "uri"), "cell.yaml");
}

TEST(RosQuestions, UnsupportedFiltersForEntitiesAreRefused) {
  const auto with = [](const std::string& filter) {
    srv::GetEntities_Request request;
    request.filters.filter = filter;
    return ask(request);
  };
  srv::GetEntities_Request tagged;
  tagged.filters.tags.tags = {"red"};
  expect_no(ask(tagged), ControlResult::unsupported, "Components have no tags here");
  srv::GetEntities_Request bounded;
  bounded.filters.bounds.points.resize(2);
  expect_no(ask(bounded), ControlResult::unsupported, "There is no filter by bounds here");
  for (const std::string& wrong : {std::string(201, 'a'), std::string("a{3}"), std::string("a\nb")})
    expect_no(with(wrong), ControlResult::unsupported, "at most 200 characters, without repetition counts");
  expect_no(with("(a"), ControlResult::failed, "The filter '(a' is no POSIX extended regular expression.");
  EXPECT_TRUE(std::holds_alternative<Asked>(with(std::string(200, 'a'))));
}

TEST(RosQuestions, OnlySettableFieldsAreSet) {
  srv::SetEntityState_Request request;
  request.entity = "P";
  request.state.header.frame_id = "map";
  expect_no(ask(request), ControlResult::unsupported, "The frame 'map' is not known here");
  request.state.header.frame_id = "world";
  request.set_acceleration = true;
  expect_no(ask(request), ControlResult::unsupported, "An acceleration cannot be set");
  request.set_acceleration = false;
  EXPECT_EQ(argument_of(ask(request), "position"), "no position");
  request.set_pose = true;
  request.state.pose.position.x = 1.5;
  EXPECT_EQ(argument_of(ask(request), "position"), "1.5 0 0");
  EXPECT_EQ(argument_of(ask(request), "linear_velocity"), "no linear_velocity");
  const auto orientation = [&](double x, double y, double z, double w) {
    auto& q = request.state.pose.orientation;
    q = {x, y, z, w};
    return argument_of(ask(request), "orientation");
  };
  EXPECT_EQ(orientation(0, 0, 0, 0), "0 0 0 1") << "a message that says nothing of it";
  EXPECT_EQ(orientation(1, 0, 0, 0), "1 0 0 0");
  EXPECT_EQ(orientation(0, 1, 0, 0), "0 1 0 0");
  EXPECT_EQ(orientation(0, 0, 1, 0), "0 0 1 0");
  EXPECT_EQ(orientation(0, 0, 0, 2), "0 0 0 2");
  request.set_twist = true;
  request.state.twist.angular.z = 0.5;
  EXPECT_EQ(argument_of(ask(request), "angular_velocity"), "0 0 0.5");
}

TEST(RosQuestions, FilesAndCopiesAreSpawned) {
  srv::SpawnEntity_Request request;
  const auto with = [&](const std::string& uri) {
    request.entity_resource.uri = uri;
    return ask(request);
  };
  expect_no(with(""), ControlResult::no_resource, "The uri is missing: a mesh file, or copy_of:NAME");
  request.entity_namespace = "line1";
  expect_no(with("a.obj"), ControlResult::unsupported, "Parts have no topics of their own");
  request.entity_namespace = "";
  request.initial_pose.header.frame_id = "map";
  expect_no(with("a.obj"), ControlResult::unsupported, "The frame 'map' is not known here");
  request.initial_pose.header.frame_id = "";
  for (const char* wrong : {"a.obj?mass_kg", "a.obj?=3", "a.obj?a=1&&b=2"})
    expect_no(with(wrong), ControlResult::spawn_parse_error, "stand NAME=VALUE, separated by &.");
  const Question bolt = with("bolts/m6.obj?mass=0.02&hierarchy=3");
  EXPECT_EQ(argument_of(bolt, "uri"), "bolts/m6.obj");
  EXPECT_EQ(argument_of(bolt, "mass"), "0.02");
  EXPECT_EQ(argument_of(bolt, "hierarchy"), "3");
  EXPECT_EQ(argument_of(bolt, "name"), "");
  EXPECT_EQ(argument_of(bolt, "allow_renaming"), "false");
  EXPECT_EQ(argument_of(with("a.obj?"), "uri"), "a.obj");
  EXPECT_EQ(argument_of(with("copy_of:P"), "name"), "");
  // An unnamed object gets a name if that is allowed.
  request.allow_renaming = true;
  EXPECT_EQ(argument_of(with("bolts/m6.obj?mass=0.02"), "name"), "m6");
  EXPECT_EQ(argument_of(with("copy_of:P"), "name"), "P");
  EXPECT_EQ(argument_of(with("copy_of:P"), "copy_of"), "P");
  request.name = "Q";
  EXPECT_EQ(argument_of(with("copy_of:P"), "name"), "Q");
  EXPECT_EQ(argument_of(with("m6.obj"), "name"), "Q");
}

TEST(RosAnswers, AnswersOfFailuresHaveNoOtherFields) {
  const ControlReply failed{1, ControlResult::failed, "It could not be."};
  srv::GetEntities_Response entities;
  respond(failed, "\n", entities);
  EXPECT_EQ(entities.result.error_message, "It could not be.");
  EXPECT_TRUE(entities.entities.empty());
  srv::GetEntityState_Response state;
  respond(failed, "", state);
  EXPECT_EQ(state.result.result, 4);
  EXPECT_EQ(state.state.header.frame_id, "");
  srv::GetSimulationState_Response simulation;
  respond(failed, "", simulation);
  EXPECT_EQ(simulation.state.state, 0);
}

TEST(RosAnswers, EntitiesAreListedByExpressionAndCategory) {
  requests::GetEntitiesResponse listed;
  listed.entities = {{.name = "P1", .type = ComponentType::part},
                     {.name = "G", .type = ComponentType::gripper},
                     {.name = "T", .type = ComponentType::ground}};
  ControlReply reply{1, ControlResult::ok, "", arguments_of(listed)};
  const auto names = [&](const std::string& note) {
    srv::GetEntities_Response response;
    respond(reply, note, response);
    return response.entities;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names("\n"), (Names{"P1", "G", "T"}));
  EXPECT_EQ(names("^P\n"), Names{"P1"});
  EXPECT_EQ(names("\n0"), Names{"P1"});
  EXPECT_EQ(names("\n1"), Names{"G"});
  EXPECT_EQ(names("T|G\n15"), (Names{"G", "T"}));
  srv::GetEntities_Response nothing;
  reply.values[0].value.text = "[{";
  respond(reply, "\n", nothing);
  EXPECT_TRUE(nothing.entities.empty());
}

}  // namespace
}  // namespace takt::ros
